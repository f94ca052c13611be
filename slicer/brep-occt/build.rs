//! Builds the C++ side of the feature `occt`; does nothing without the feature.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "occt")]
    occt::build();
}

#[cfg(feature = "occt")]
mod occt {
    use std::path::PathBuf;
    use std::process::exit;

    /// A header that only the last of the packages has.
    const HEADER: &str = "STEPControl_Reader.hxx";
    const SOURCES: [&str; 2] = ["read.cpp", "mesh.cpp"];
    const HEADERS: [&str; 2] = ["model.hpp", "shim.hpp"];
    /// The libraries. Each precedes the libraries that it needs.
    const LIBRARIES: [&str; 13] = [
        "TKIGES",
        "TKSTEP",
        "TKSTEPBase",
        "TKXSBase",
        "TKMesh",
        "TKShHealing",
        "TKTopAlgo",
        "TKGeomAlgo",
        "TKBRep",
        "TKGeomBase",
        "TKG3d",
        "TKMath",
        "TKernel",
    ];

    pub(super) fn build() {
        for name in ["OCCT_INCLUDE_DIR", "OCCT_LIB_DIR"] {
            println!("cargo::rerun-if-env-changed={name}");
        }
        let headers = headers();
        for file in SOURCES.iter().chain(&HEADERS) {
            println!("cargo::rerun-if-changed=src/{file}");
        }
        cc::Build::new()
            .cpp(true)
            .std("c++17")
            // The crate does not own these headers, so it shows no warnings about them.
            .flag("-isystem")
            .flag(&headers)
            .opt_level(2)
            .files(SOURCES.map(|file| format!("src/{file}")))
            .compile("lamp_occt");
        if let Ok(folder) = std::env::var("OCCT_LIB_DIR") {
            println!("cargo::rustc-link-search=native={folder}");
        }
        for library in LIBRARIES {
            println!("cargo::rustc-link-lib=dylib={library}");
        }
    }

    fn headers() -> PathBuf {
        let given = std::env::var_os("OCCT_INCLUDE_DIR").map(PathBuf::from);
        let usual = ["/usr/include/opencascade", "/usr/local/include/opencascade"];
        let mut folders = given.into_iter().chain(usual.map(PathBuf::from));
        folders.find(|folder| folder.join(HEADER).is_file()).unwrap_or_else(|| {
            println!(
                "cargo::error=the feature occt needs OpenCASCADE 7.6: on Debian, \
                 `apt-get install g++ libocct-data-exchange-dev`, or give OCCT_INCLUDE_DIR (with \
                 {HEADER}) and OCCT_LIB_DIR"
            );
            exit(1)
        })
    }
}
