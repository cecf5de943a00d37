"""Mends what Doxygen 1.9.4 gets wrong in its pages: links to anchors that are elsewhere or nowhere."""
import re


def mend(api):
    """Changes the files of the folder `api` in place."""
    anchors, pages = {}, {}
    for page in api.glob("*.html"):
        pages[page.name] = set(re.findall(r'\b(?:id|name)="([^"]+)"', page.read_text()))
        for anchor in pages[page.name]:
            anchors.setdefault(anchor, []).append(page.name)

    # A summary offers nested classes although all of them are private.
    for page in api.glob("*.html"):
        if "nested-classes" not in pages[page.name]:
            replace(page, r'<a href="#nested-classes">Classes</a> &#124;\n?', "")

    # The tree has a header's functions on the header's page; they are documented on their namespace's.
    def where_it_is(found):
        page, anchor = found[1], found[2]
        there = anchors.get(anchor, [])
        known = anchor in pages.get(page, ()) or len(there) != 1
        return found[0] if known else f'"{there[0]}#{anchor}"'

    for script in api.glob("*.js"):
        if not script.name.startswith("navtreeindex"):  # there the addresses are keys
            replace(script, r'"([\w.-]+\.html)#(\w+)"', where_it_is)


def replace(path, pattern, by):
    text = path.read_text()
    changed = re.sub(pattern, by, text)
    if changed != text:
        path.write_text(changed)
