"""After a verb, the one that usually comes next: the only list of them."""

from rig.cli.output import tell

NEXT: dict[str, str] = {
    "devices": "rig profile new NAME, or rig setup NAME, which leads through everything",
    "devices, none": "plug cameras in and rig devices again; without hardware: rig setup sim",
    "profile list": "rig profile show NAME, or rig setup NAME",
    "profile show": "rig profile check {profile}",
    "profile new": "settle the lines that say MEASURE, then rig profile check {profile}",
    "profile check": "rig check {profile}",
    "profile check, doubts": "settle these lines, then rig profile check {profile} again",
    "target": "print it at 100 %, measure it, then rig check {profile}",
    "check": "rig calibrate {profile}, or rig sweep {profile} where it is calibrated",
    "check, no move": "rig check {profile} with its stage, once the way of the carriage is clear",
    "check, bundle": "look through the bundle and send it; rig check PROFILE --bundle says more",
    "check, fail": "do what stands behind the arrows, then rig check {profile} again",
    "calibrate": "rig sweep {profile}; without a stage rig capture {profile}",
    "calibrate, one camera": "rig export ID --format opencv, or ros; ID is its number",
    "calibrate, weak": "do what the verdict says, then rig calibrate {profile} again",
    "calibrate, scene": "rig capture {profile} --slopes-only; a board makes depth sure",
    "import": "rig check {profile}, which says whether it fits the cameras of today",
    "import, weak": "rig calibrate {profile}, or do what the verdict says where it was made",
    "sweep": "rig capture {profile}",
    "sweep, dry run": "rig sweep {profile}, without --dry-run",
    "sweep, gate": "rig report {sweep} shows where; then rig check {profile}",
    "capture": "rig compare {profile}; rig capture {profile} --view shows it live",
    "capture, gate": "rig check {profile}",
    "compare": "rig capture {profile}",
    "history": "rig report SWEEP, or what the table says",
    "report": "rig capture PROFILE uses the curve",
    "store verify": "rig store backup DIR",
    "store verify, damage": "rig store restore DIR, from a backup into a new place",
    "store backup": "the same again later: only what is new is copied then",
    "store restore": "rig store verify",
    "store prune": "rig store du",
    "store prune, dry run": "the same with --yes",
    "store du": "rig store prune --older-than DAYS",
    "store move": "rig store verify, with the new --db",
    "store migrate": "rig store verify --db URL",
    "export": "give the file to the other program; rig capture PROFILE goes on here",
}
"""By verb, and by how it ended; what is in braces is known then."""


def tell_next(verb: str, *, as_json: bool, **known: object) -> None:
    """Name the next verb in one line on stderr; nothing where the answer is for a program.

    Args:
        verb: a key of `NEXT`.
        as_json: whether the verb printed JSON.
        known: what the line names.
    """
    if not as_json:
        tell(f"next: {NEXT[verb].format(**known)}")
