"""Changes of valid inputs that keep most of their structure."""

import copy
import json
import random
import re
import struct
from typing import Any

import yaml

NUMBERS = (
    *("0", "-1", "1", "2", "255", "256", "65535", "65536", "2147483648", "-2147483649"),
    *("9223372036854775807", "18446744073709551616", "1e308", "-1e309", "1e-320", "nan", "NaN"),
    *("inf", "-inf", ".inf", "Infinity", "0x7f", "1_000", "00", "1.5", "-0.0", "1e5", "9" * 400),
    *("9" * 5000, "1:2:3", "true", "null", "~", '""', "[]", "{}", "'x'", "2024-13-45", "!!int 3"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 255, 65536, 2**31, -(2**63), 2**64, 10**30, 1e308, -1e-320),
    *(float("nan"), float("inf"), "", "x", "é", "\x00", "\ud800", "a" * 10_000, "../..", "/etc"),
    *([], {}, [[]], [None], [0.0], {"a": 1}, [1, 2, 3], ["x"] * 5, 0.5, 700.0, -3.25),
)
_TOKEN = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?|\"[^\"\n]*\"|[A-Za-z_][\w-]*|[\[\]{}(),:=<>]")
_SIGNS = "[]{}(),:=#&*!|>'\"%@`<>?-\\\t\r\n\0\x1b\x7f\x80é\u2028\ufeff"


def text(rng: random.Random, valid: str) -> str:
    """Change a few words, lines or signs of a text."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        valid = rng.choice((_word, _word, _word, _line, _sign, _deep, _cut))(rng, valid)
    return valid


def _word(rng: random.Random, valid: str) -> str:
    words = list(_TOKEN.finditer(valid))
    if not words:
        return valid + rng.choice(NUMBERS)
    word = rng.choice(words)
    new = rng.choice((rng.choice(NUMBERS), rng.choice(words)[0], "", word[0] * 2))
    return valid[: word.start()] + new + valid[word.end() :]


def _line(rng: random.Random, valid: str) -> str:
    lines = valid.split("\n")
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[other])
        case 2:
            lines[at], lines[other] = lines[other], lines[at]
        case _:
            lines[at] = rng.choice((" ", "  ", "\t")) + lines[at]
    return "\n".join(lines)


def _sign(rng: random.Random, valid: str) -> str:
    at = rng.randrange(len(valid) + 1)
    return valid[:at] + rng.choice(_SIGNS) * rng.choice((1, 1, 3)) + valid[at + rng.randrange(3) :]


def _deep(rng: random.Random, valid: str) -> str:
    if rng.random() < 0.8:
        return _word(rng, valid)
    at = rng.randrange(len(valid) + 1)
    return valid[:at] + rng.choice("[{(<'a.") * rng.choice((50, 1000, 20_000)) + valid[at:]


def _cut(rng: random.Random, valid: str) -> str:
    return valid[: rng.randrange(len(valid) + 1)] if rng.random() < 0.2 else _sign(rng, valid)


def block(rng: random.Random, valid: str) -> str:
    """Leave out, double or move a part between two headings, or a comment's sign before a line."""
    parts = re.split(r"(?m)^(?=\S)", valid)
    at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(5):
        case 0:
            del parts[at]
        case 1:
            parts.insert(other, parts[at])
        case 2:
            parts[at], parts[other] = parts[other], parts[at]
        case 3:
            parts[at] = "#" + parts[at]
        case _:
            kept = rng.randrange(3)
            parts = parts[at : at + kept]
    return "".join(parts)


def many(rng: random.Random, valid: str) -> str:
    """Repeat a line, a word or a blank more often than any file has them."""
    lines = valid.split("\n")
    at = rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            lines[at : at + 1] = [lines[at]] * rng.choice((300, 3000, 30_000))
        case 1:
            lines[at] += ", 0" * 25_000
        case 2:
            lines.append("\n" * 4_100_000)
        case _:
            lines[at] = (lines[at] + " ") * rng.choice((30, 1000))
    return "\n".join(lines)


def xml(rng: random.Random, valid: str) -> str:
    """Change a tag from its beginning to its end, what it holds, or put a part where none belongs.

    `valid` has a root and one tag a line.
    """
    tags = sorted(set(re.findall(r"</?(\w+)", valid)))
    tag, other = rng.choice(tags), rng.choice((*tags, "_", "x"))
    match rng.randrange(6):
        case 0:
            return re.sub(rf"(</?){tag}\b", rf"\g<1>{other}", valid)
        case 1:
            part = rng.choice(('<!DOCTYPE x [<!ENTITY a "b">]>', "<!-- x -->", "<a/>", "<_>1</_>"))
            at = rng.choice([found.end() for found in re.finditer(">", valid)])
            return valid[:at] + part * rng.choice((1, 1, 40)) + valid[at:]
        case 2:
            depth = rng.choice((3, 60, 3000))
            return valid.replace(f"<{tag}>", "<_>" * depth).replace(f"</{tag}>", "</_>" * depth)
        case 3:
            return re.sub(rf"(?s)<{tag}\b[^>]*>.*?</{tag}>", "", valid, count=1)
        case 4:
            inside = rng.choice(("", "<_>1</_><_>2.5</_>", rng.choice(NUMBERS)))
            whole = rf"(?s)(<{tag}\b[^>]*>).*?(</{tag}>)"
            return re.sub(whole, lambda found: found[1] + inside + found[2], valid, count=1)
        case _:
            return text(rng, valid)


def tree(rng: random.Random, valid: Any) -> Any:
    """Change a few places of what JSON holds; the original stays."""
    changed = json.loads(json.dumps(valid))
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        changed = _leaf(rng, changed) if rng.random() < 0.4 else _branch(rng, changed)
    return changed


def _leaf(rng: random.Random, place: Any) -> Any:
    """Change one of all values that hold no others, however deep."""
    found: list[tuple[Any, Any]] = []
    ahead = [place]
    while ahead:
        holder = ahead.pop()
        if not isinstance(holder, dict | list):
            continue
        for key, value in holder.items() if isinstance(holder, dict) else enumerate(holder):
            if isinstance(value, dict | list) and value:
                ahead.append(value)
            else:
                found.append((holder, key))
    if found:
        holder, key = rng.choice(found)
        holder[key] = _branch(rng, holder[key])
    return place


def _branch(rng: random.Random, place: Any) -> Any:
    if isinstance(place, dict) and place and rng.random() < 0.85:
        key = rng.choice(list(place))
        match rng.randrange(8):
            case 0:
                del place[key]
            case 1:
                place[rng.choice(("", "x", "name", key + "_"))] = place[key]
            case _:
                place[key] = _branch(rng, place[key])
        return place
    if isinstance(place, list) and place and rng.random() < 0.85:
        at = rng.randrange(len(place))
        match rng.randrange(8):
            case 0:
                del place[at]
            case 1:
                place.insert(at, place[at])
            case 2:
                del place[at:]
            case _:
                place[at] = _branch(rng, place[at])
        return place
    if isinstance(place, float) and rng.random() < 0.5:
        return rng.choice((-place, place * 1e6, place * 1e-6, place + 1.0, 0.0, str(place)))
    if isinstance(place, int) and rng.random() < 0.5:
        return rng.choice((-1, 0, 1, 2, 3, 4, place + 1, 2 * place))
    return copy.deepcopy(rng.choice(VALUES))


def as_json(rng: random.Random, valid: Any) -> str:
    """A changed tree as text, which is now and then changed as well."""
    written = json.dumps(tree(rng, valid))
    return text(rng, written) if rng.random() < 0.15 else written


def as_yaml(rng: random.Random, valid: str) -> str:
    """The same for what YAML holds."""
    changed = tree(rng, yaml.safe_load(valid))
    try:
        written = yaml.safe_dump(changed, default_flow_style=rng.choice((None, True, False)))
    except yaml.YAMLError:  # a sign that no YAML holds
        return text(rng, valid)
    return text(rng, written) if rng.random() < 0.15 else written


def raw(rng: random.Random, valid: bytes) -> bytes:
    """Change a few bytes or numbers, or cut."""
    changed = bytearray(valid)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at = rng.randrange(len(changed) + 1) if rng.random() < 0.6 else rng.randrange(64)
        match rng.randrange(6):
            case 0:
                changed[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                changed[at : at + 4] = struct.pack(
                    rng.choice("<>") + "I", rng.choice((0, 1, 255, 65535, 65536, 2**31, 2**32 - 1))
                )
            case 2:
                changed[at : at + 2] = struct.pack(
                    rng.choice("<>") + "H", rng.choice((0, 1, 255, 256, 32768, 65535))
                )
            case 3:
                del changed[at : at + rng.choice((1, 4, 16, 4096))]
            case 4:
                changed[at:at] = changed[at : at + rng.choice((1, 8, 64))]
            case _:
                if rng.random() < 0.2:
                    del changed[at:]
    return bytes(changed)
