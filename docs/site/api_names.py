"""What Doxygen's tag file says of the API reference: its headers, their classes, the page of each."""
import re
import xml.etree.ElementTree


class ApiNames:
    """pages: {a header's path or a class's name: its page}; headers: {a header's path: [class]}."""

    def __init__(self, tags):
        self.pages, self.headers = {}, {}
        compounds = list(xml.etree.ElementTree.parse(tags).getroot().iter("compound"))
        for compound in compounds:
            if compound.get("kind") in ("class", "struct", "concept"):
                self.pages[self.plain(compound.findtext("name"))] = self.page(compound)
        for compound in compounds:
            if compound.get("kind") != "file" or not compound.findtext("name").endswith("pp"):
                continue
            header = re.sub(r"^.*/solenoid/", "", (compound.findtext("path") or "") + compound.findtext("name"))
            names = {self.plain(found.text) for kind in ("class", "concept") for found in compound.iter(kind)}
            self.pages[header] = self.page(compound)
            self.headers[header] = sorted(name for name in names if re.fullmatch(r"[\w:]+", name) and name in self.pages)

    @staticmethod
    def plain(name):
        return name.removeprefix("solenoid::")

    @staticmethod
    def page(compound):
        page = compound.findtext("filename")
        return page if page.endswith(".html") else page + ".html"
