"""Tables that a phone can show: there every row becomes a card, with its column beside each cell.

The columns' names stand in the page already; for every wide table some rules of style repeat them.
"""

import re
from html import unescape

FEWEST_COLUMNS = 4
"""What has fewer fits a phone as it is."""
_TABLE = re.compile(r"<table(.*?)>(?=(.*?)</table>)", re.DOTALL)
_HEAD = re.compile(r"<thead>(.*?)</thead>", re.DOTALL)
_NAME = re.compile(r"<th\b[^>]*>(.*?)</th>", re.DOTALL)
_MARK = re.compile(r"<[^>]*>")
_END_OF_STYLE = "</style>"


def as_cards(page: str) -> str:
    """Name the columns of every wide table in the page's style, and mark the table.

    Args:
        page: HTML with a style, whose tables have a head of one row.
    """
    rules: list[str] = []

    def marked(found: re.Match[str]) -> str:
        head = _HEAD.search(found[2])
        names = _NAME.findall(head[1]) if head else []
        if len(names) < FEWEST_COLUMNS:
            return found[0]
        table = f"cards-{len(rules)}"
        rules.append("".join(_rule(table, at, name) for at, name in enumerate(names, start=1)))
        return f'<table{found[1]} id="{table}">'

    marked_page = _TABLE.sub(marked, page)
    return marked_page.replace(_END_OF_STYLE, "".join(rules) + _END_OF_STYLE, 1)


def _rule(table: str, at: int, name: str) -> str:
    text = " ".join(unescape(_MARK.sub(" ", name)).split())
    return f'#{table} td:nth-child({at}) {{ --column: "{_quoted(text)}"; }}\n'


def _quoted(text: str) -> str:
    """Write text for a string of CSS: whatever is no letter or digit by its number."""
    return "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in text)
