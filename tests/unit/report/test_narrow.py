"""Wide tables name their columns for phones."""

from rig.report.narrow import as_cards

WIDE = (
    '<style>a {}</style><table class="stops"><thead><tr><th></th><th class="n">from\u2013to</th>'
    "<th>a<br>b</th><th>&lt;/style&gt;</th></tr></thead><tbody><tr><td>1</td></tr></tbody></table>"
)
SMALL = "<table><thead><tr><th>a</th><th>b</th><th>c</th></tr></thead></table>"


def test_a_wide_table_is_marked_and_its_columns_are_in_the_style():
    page = as_cards(WIDE + SMALL + WIDE.partition("</style>")[2])
    style, _, body = page.partition("</style>")
    assert '#cards-0 td:nth-child(1) { --column: ""; }' in style
    assert '#cards-0 td:nth-child(2) { --column: "from\\2013 to"; }' in style
    assert '#cards-0 td:nth-child(3) { --column: "a\\20 b"; }' in style
    assert '#cards-1 td:nth-child(4) { --column: "\\3c \\2f style\\3e "; }' in style
    assert '<table class="stops" id="cards-0">' in body
    assert '<table class="stops" id="cards-1">' in body
    assert "<td>1</td>" in body
    assert SMALL in body


def test_a_page_without_tables_stays_as_it_is():
    assert as_cards("<style></style><p>text</p>") == "<style></style><p>text</p>"
