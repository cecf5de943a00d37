"""A Sphinx extension: names of headers and classes in inline code lead to the API reference, and indented code is coloured."""
import re

from api_names import ApiNames
from docutils import nodes
from pygments.lexers import get_lexer_by_name
from pygments.token import Error
from sphinx.transforms import SphinxTransform
from sphinx.util.osutil import relative_uri


class ApiLinks(SphinxTransform):
    """Wraps inline code that is a header or a class into a link."""

    default_priority = 700

    def apply(self, **_):
        if self.env.docname.startswith("source/"):
            return
        names = self.app.api_names
        here = self.app.builder.get_target_uri(self.env.docname)
        for literal in list(self.document.findall(nodes.literal)):
            page = names.get(literal.astext())
            if page is None or isinstance(literal.parent, nodes.reference) or self.in_title(literal):
                continue
            link = nodes.reference("", "", literal.deepcopy(), internal=False, refuri=relative_uri(here, "api/" + page))
            link["classes"].append("api")
            literal.replace_self(link)

    @staticmethod
    def in_title(node):
        while node is not None and not isinstance(node, nodes.title):
            node = node.parent
        return node is not None


def language_of(text):
    """What an indented block is written in, or None."""
    lines = [line for line in text.split("\n") if line.strip()]
    if all(re.match(r"(\$ |# |\./solenoid\b|cmake |git |apt-get |npm |python3 |pip |sudo |[A-Z_]+=\S+ )", line) for line in lines[:1]):
        return "bash"
    if any(re.match(r"\[{1,2}[\w.]+\]{1,2}\s*(#.*)?$", line) for line in lines):
        return "toml"
    if any(re.search(r"^#include |;\s*(//.*)?$|^template <", line) for line in lines):
        return "cpp"
    if any(re.match(r"(import|from) \w+", line) for line in lines):
        return "python"
    return None


class IndentedCode(SphinxTransform):
    """Gives blocks without a language that of their text, where that reads without an error."""

    default_priority = 210

    def apply(self, **_):
        for block in self.document.findall(nodes.literal_block):
            if block.get("language", "none") != "none":
                continue
            language = language_of(block.astext())
            if language and all(kind is not Error for kind, _ in get_lexer_by_name(language).get_tokens(block.astext())):
                block["language"] = language


def read_tags(app):
    app.api_names = ApiNames(app.config.api_tags).pages


def setup(app):
    app.add_config_value("api_tags", None, "env")
    app.connect("builder-inited", read_tags)
    app.add_transform(ApiLinks)
    app.add_transform(IndentedCode)
    return {"parallel_read_safe": True}
