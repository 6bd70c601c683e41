#!/usr/bin/env python3
"""Checks that the pages' texts are complete in every language: page_texts_test.py WEB_FOLDER

Every text that stands in a page's HTML has a key (data-text, data-text-title, data-text-label) or translate="no". The
English dictionary has the keys that scripts use, text("KEY"), and no others; every other one has these and those of the
HTML, and no others. Texts of a key have the same {places}.
"""
import html.parser
import pathlib
import re
import sys

ATTRIBUTES = {"title": "data-text-title", "aria-label": "data-text-label"}
EMPTY = {"meta", "link", "input", "br", "img"}


class Page(html.parser.HTMLParser):
    """Keys of a page, and its texts without one."""

    def __init__(self, text):
        super().__init__()
        self.keys, self.bare, self.open = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.keys.update(value for name, value in attributes.items() if name.startswith("data-text"))
        for shown, key in ATTRIBUTES.items():
            if shown in attributes and key not in attributes:
                self.bare.append(attributes[shown])
        if tag not in EMPTY:
            self.open.append("data-text" in attributes or attributes.get("translate") == "no")

    def handle_endtag(self, tag):
        self.open.pop()

    def handle_data(self, data):
        if re.search(r"[A-Za-z]", data) and not (self.open and self.open[-1]):
            self.bare.append(data.strip())


def dictionaries(text):
    """{language: {key: text}} of texts.js."""
    found = {}
    for line in text.splitlines():
        if language := re.fullmatch(r"  (\w+): \{", line):
            entries = found[language[1]] = {}
        elif entry := re.fullmatch(r'    "([^"]+)": "(.*)",', line):
            assert entry[1] not in entries, f"{entry[1]} is there twice"
            entries[entry[1]] = entry[2]
    return found


def main():
    web = pathlib.Path(sys.argv[1])
    pages = {path.name: Page(path.read_text()) for path in web.glob("*.html")}
    scripts = "".join(path.read_text() for path in web.glob("*.js") if path.name not in ("text.js", "texts.js"))
    texts = dictionaries((web / "texts.js").read_text())
    wrong = [f"{name}: {text!r} has no key" for name, page in pages.items() for text in page.bare]
    in_html = set().union(*(page.keys for page in pages.values()))
    in_scripts = set(re.findall(r'\btext\("([^"]+)"', scripts))
    wrong += [f"text({call}: a key is a plain string" for call in re.findall(r"\btext\(([^\")][^)]*)", scripts)]
    assert len(texts) > 1 and in_html and in_scripts, "nothing was found"
    for language, entries in texts.items():
        needed = in_scripts if language == "en" else in_scripts | in_html
        wrong += [f"texts.js: {language} lacks {key}" for key in sorted(needed - entries.keys())]
        wrong += [f"texts.js: {language} has {key}, which nothing uses" for key in sorted(entries.keys() - needed)]
        places = lambda text: set(re.findall(r"\{\w+\}", text))
        wrong += [f"texts.js: {language}: {key} has other places than the English text"
                  for key in entries.keys() & texts["en"].keys() if places(entries[key]) != places(texts["en"][key])]
    assert not wrong, "\n".join(wrong)


if __name__ == "__main__":
    main()
