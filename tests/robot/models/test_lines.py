import tomllib

from app.robot.models.lines import key_lines, line_of

TEXT = '''\
# a comment = no key
a = 1
"quoted key" = 2
dotted.name = 3

long = """
[not.a.table]
no = "key"
"""

[table]
b = [  # opens
  "]",
  { c = 1 },
]
d = 'it''s'

[[many]]
x = 1
[many.inside]
y = 2
[[many]]
x = 3
  [[many.deep]]
  z = 4
'''.replace("'it''s'", "'its'")


def test_every_key_has_its_line() -> None:
    tomllib.loads(TEXT)
    lines = key_lines(TEXT)
    text = TEXT.splitlines()
    for path, start in {
        ("a",): "a = 1",
        ("quoted key",): '"quoted key" = 2',
        ("dotted", "name"): "dotted.name = 3",
        ("long",): 'long = """',
        ("table",): "[table]",
        ("table", "b"): "b = [  # opens",
        ("table", "d"): "d = 'its'",
        ("many", 0): "[[many]]",
        ("many", 0, "x"): "x = 1",
        ("many", 0, "inside", "y"): "y = 2",
        ("many", 1, "x"): "x = 3",
        ("many", 1, "deep", 0, "z"): "  z = 4",
    }.items():
        assert text[lines[path] - 1] == start, path
    assert ("table", "c") not in lines
    assert ("not", "a", "table") not in lines


def test_what_has_no_line_takes_that_of_what_holds_it() -> None:
    lines = key_lines(TEXT)
    assert line_of(lines, ("table", "b", 1, "c")) == lines["table", "b"]
    assert line_of(lines, ("many", 1, "missing")) == lines["many", 1]
    assert line_of(lines, ("nowhere",)) == 1
