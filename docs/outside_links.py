"""Preprocessor of the book: turns links that leave `docs/` into links that work in it.

Pages link to files of the repository, so that they can be read there. In the book, the figures of
`benches/README.md` are a page, `benchmarks.md`; other files keep their name only.
"""

import json
import re
import sys


def without_outside_links(text):
    text = text.replace("The figures are in [benches/README.md](../benches/README.md).\n", "")
    text = text.replace("](../benches/README.md", "](benchmarks.md")
    text = text.replace("](../docs/", "](")
    return re.sub(r"\[([^]]*)\]\(\.\./[^)]*\)", r"\1", text)


def rewrite(items):
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            chapter = item["Chapter"]
            chapter["content"] = without_outside_links(chapter["content"])
            rewrite(chapter["sub_items"])


if sys.argv[1:2] == ["supports"]:
    sys.exit(0)
_, book = json.load(sys.stdin)
rewrite(book.get("items", book.get("sections", [])))
json.dump(book, sys.stdout)
