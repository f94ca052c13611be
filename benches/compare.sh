#!/usr/bin/env bash
# Times the whole job beside other programs on the same files, and prints the
# tables of benches/README.md. CPU is user + system seconds; each figure is the
# median of five runs, but PrusaSlicer, which takes minutes, runs once. Needs
# GNU time; a peer that is not installed is left out.
#
#   benches/compare.sh [FACETS ...]        default: 100k 750k 5.5M
#
# MSLICER=path/to/mslicer adds mslicer, ISLAND_SCAN=path/to/island_scan_cli
# DragonFruit's search for islands, LIMIT=path/to/slice a slicer that does no more
# than the least: crossings in 32 bits, a frame of 76.2 mm from ORIGIN, no survey,
# no check and no digest, called as `slice IN OUT DPI UM A THREADS`. Needs 3 GB in
# TMPDIR.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --quiet -p lamp-cli
cargo build --release --quiet -p lamp-benches --examples
bin=$PWD/target/release
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
PATH=$bin:$PATH

# timed RUNS COMMAND...: sets cpu, mb and wall to the medians of CPU seconds,
# peak memory in MB and wall seconds
timed() {
    local runs=$1
    shift
    for _ in $(seq "$runs"); do
        /usr/bin/time -f '%U %S %M %e' -o time "$@" >/dev/null 2>errors ||
            { echo "failed: $*" >&2 && cat errors >&2 && exit 1; }
        awk '{print $1 + $2, $3 / 1000, $4}' time
    done >times
    median() { cut -d' ' -f"$1" times | sort -n | sed -n "$(((runs + 1) / 2))p"; }
    cpu=$(median 1) mb=$(median 2) wall=$(median 3)
}

header() { # header TITLE
    printf '\n| %s | CPU | wall | peak memory | CPU / that of the first |\n|---|---|---|---|---|\n' "$1"
    first=
}

row() { # row [-1] NAME COMMAND...
    local runs=5
    [ "$1" = -1 ] && { runs=1 && shift; }
    local name=$1 cpu mb wall
    shift
    timed $runs "$@"
    first=${first:-$cpu}
    awk -v n="$name" -v c="$cpu" -v m="$mb" -v w="$wall" -v f="$first" \
        'BEGIN {printf "| %s | %.2f s | %.2f s | %.0f MB | %.2f |\n", n, c, w, m, c / f}'
}

has() { command -v "$1" >/dev/null; }

cat >sla.ini <<'INI'
printer_technology = SLA
bed_shape = 0x0,76.4x0,76.4x76.1,0x76.1
display_width = 76.4032
display_height = 76.0476
display_pixels_x = 4512
display_pixels_y = 4491
max_print_height = 200
layer_height = 0.1
initial_layer_height = 0.1
supports_enable = 0
pad_enable = 0
INI

slices() {
    header "slicing"
    row "\`sha256sum blade.stl\`" sha256sum blade.stl
    row "\`slice blade.stl\`" slice blade.stl -o blade.tif
    row "\`slice blade.stl --threads 1\`" slice blade.stl --threads 1 -o blade.tif
    row "\`slice blade.stl --memory 64MB\`" slice blade.stl --memory 64MB -o blade.tif
    row "\`slice blade.stl --memory 16MB\`" slice blade.stl --memory 16MB -o blade.tif
    [ -z "${LIMIT:-}" ] || ORIGIN=-38.1,-38.1,-0.5 \
        row "the least that slices" "$LIMIT" blade.stl other.tif 1500 100 A 2
    "$bin/examples/shuffle" blade.stl shuffled.stl
    row "\`slice shuffled.stl\` (facets in random order)" slice shuffled.stl -o other.tif
    row "\`slice shuffled.stl --memory 64MB\`" slice shuffled.stl --memory 64MB -o other.tif
    rm shuffled.stl
    row "\`slice blade.stl --rotate x:30,z:15\`" slice blade.stl --rotate x:30,z:15 -o other.tif
    [ -z "${MSLICER:-}" ] || row "mslicer, to .goo" "$MSLICER" --mesh blade.stl \
        --platform-resolution 4512,4491 --platform-size 76.4032,76.0476,200 --layer-height 0.1 other.goo
}

stages() {
    header "the stack again"
    ! has tiffcp || row "\`tiffcp -c g4\` (libtiff: decode and encode)" tiffcp -c g4 blade.tif other.tif
    row "\`lamp convert\` (read, do nothing, write)" lamp convert blade.tif -o other.tif
    row "\`fix\`" fix blade.tif -o other.tif
    row "\`dither\`" dither blade.tif -o other.tif
    row "\`tile --mesh none\` (one copy on 4 x 4.5 in)" tile --mesh none blade.tif -o other.tif
    row "\`tile\` (the same in a mesh)" tile blade.tif -o other.tif
}

# What finding islands takes, on the stack and from the part.
checks() {
    header "checks"
    row "\`lamp convert\` (read, do nothing, write)" lamp convert blade.tif -o other.tif
    row "\`lamp check blade.tif\` (all kinds)" lamp check -q blade.tif
    row "\`lamp check blade.stl\` (the same, slicing on the way)" lamp check -q blade.stl
    row "\`lamp check blade.stl --rotate x:180\`" lamp check -q blade.stl --rotate x:180
    [ -z "${ISLAND_SCAN:-}" ] || row -1 "DragonFruit's \`island_scan_cli\` (islands alone)" \
        "$ISLAND_SCAN" blade.stl --px-mm 0.016933333 --layer-height 0.1 --json
}

# What a check and a repair of the mesh take beside ADMesh.
meshes() {
    header "the mesh"
    ! has admesh || row "\`admesh blade.stl\`" admesh blade.stl
    row "\`lamp mesh check blade.stl\`" lamp mesh check blade.stl
    row "\`lamp mesh repair blade.stl\`" lamp mesh repair blade.stl -o other.stl
    rm other.stl
}

# What the pipeline takes beside its slowest stage alone, in wall time.
pipe() { # pipe AREA
    local slowest=0 cpu mb wall
    for stage in "slice blade.stl" "fix blade.tif" "dither blade.tif" "tile --mesh none --area $1 blade.tif"; do
        # shellcheck disable=SC2086
        timed 5 $stage -o other.tif
        printf '| `%s` | %.2f s | |\n' "$stage" "$wall"
        slowest=$(awk -v a="$slowest" -v b="$wall" 'BEGIN {print (a > b ? a : b)}')
    done
    timed 5 bash -c "slice blade.stl | fix | dither | tile --mesh none --area $1 > other.tif"
    awk -v w="$wall" -v s="$slowest" -v a="$1" \
        'BEGIN {printf "| `slice blade.stl \\| fix \\| dither \\| tile --mesh none --area %s` | %.2f s | %.2f |\n", a, w, w / s}'
}

codec() {
    printf '\n| codec, a transition of the stack, one thread | encode | decode |\n|---|---|---|\n'
    "$bin/examples/codec" blade.tif >ours
    read -r _ count <ours
    line() { # line NAME FILE
        awk -v n="$1" -v count="$count" '{t[$1] = $2 * 1e9 / count}
            END {printf "| %s | %.1f ns | %.1f ns |\n", n, t["encode"], t["decode"]}' "$2"
    }
    line "\`g4::encode\`, \`g4::decode\`" ours
    if cc -O2 "$bin/../../benches/libtiff.c" -ltiff -o libtiff 2>/dev/null; then
        ./libtiff blade.tif >theirs
        line "libtiff, in memory" theirs
        awk 'NR == FNR {t[$1] = $2; next} {r[$1] = $2 / t[$1]}
            END {printf "| libtiff / ours | %.1f | %.1f |\n", r["encode"], r["decode"]}' ours theirs
    fi
}

[ $# -gt 0 ] || set -- 100k 750k 5.5M
for count in "$@"; do
    lamp sample dense-blade --facets "$count" -o blade.stl --quiet
    printf '\n### Blade mould with a denser core, %s facets, 1500 dpi, 100 um\n' "$count"
    slices
    lamp sample blade --facets "$count" -o blade.stl --quiet
    printf '\n### Blade mould, %s facets, 1500 dpi, 100 um\n' "$count"
    slices
    meshes
    stages
    checks
    printf '\n| the pipe | wall | / slowest stage alone |\n|---|---|---|\n'
    pipe 4x4.5in
    [ "$count" != 750k ] || pipe 23x23in
    if [ "$count" = 750k ]; then
        codec
        header "2400 dpi, 25 um"
        row "\`slice blade.stl --dpi 2400 --thickness 25um\`" \
            slice blade.stl --dpi 2400 --thickness 25um -o other.tif
    fi
done

has prusa-slicer || exit 0
for count in "$@"; do
    lamp sample blade --facets "$count" -o blade.stl --quiet
    header "$count facets"
    row "\`slice blade.stl\`" slice blade.stl -o blade.tif
    row -1 "PrusaSlicer, to .sl1" prusa-slicer --export-sla --load sla.ini --center 38.2,38 \
        -o other.sl1 blade.stl
done
