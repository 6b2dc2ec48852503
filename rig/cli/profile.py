"""`rig profile`: the rigs that are described, and how to describe one."""

import json
from typing import Annotated

import typer

from rig.cli.options import AsJson, Overrides, ProfileName
from rig.cli.output import show, show_json, table, tell
from rig.cli.profile_new import new_profile

app = typer.Typer(help="List, show, check and write profiles.", no_args_is_help=True)
app.command("new")(new_profile)


@app.command("list")
def list_profiles(*, as_json: AsJson = False) -> None:
    """List every profile that can be given by name."""
    from rig.errors import ConfigError
    from rig.places import profile_files
    from rig.profile.load import load_profile

    rows: list[dict[str, object]] = []
    for path in profile_files():
        try:
            description = load_profile(str(path)).description
        except ConfigError as error:
            description = f"cannot be used: {error}"
        rows.append({"name": path.stem, "description": description, "file": str(path)})
    if as_json:
        show_json({"profiles": rows})
        return
    cells = [[str(row["name"]), str(row["description"])] for row in rows]
    for line in table(cells, ("name", "description")):
        show(line)


@app.command("show")
def show_profile(
    name: ProfileName, *, overrides: Overrides = None, as_json: AsJson = False
) -> None:
    """Print a profile as it will be used, with defaults filled in."""
    from rig.profile.load import find_profile, load_profile

    profile = load_profile(name, overrides or ())
    if as_json:
        show_json(profile.model_dump(mode="json"))
        return
    tell(f"{find_profile(name)}:")
    for key, value in _flat("", profile.model_dump(mode="json")):
        show(f"{key} = {json.dumps(value)}")


@app.command("check")
def check_profile(
    names: Annotated[list[str], typer.Argument(metavar="PROFILE...", help="Names or paths.")],
    *,
    overrides: Overrides = None,
) -> None:
    """Check that profiles can be used; the first one that cannot ends with an error."""
    from rig.profile.load import load_profile

    for name in names:
        profile = load_profile(name, overrides or ())
        show(f"{name}: good; {len(profile.views)} views, camera {profile.camera.kind}")


@app.command("schema")
def show_schema() -> None:
    """Print the JSON Schema of profiles, for editors that complete and check TOML."""
    from rig.profile import Profile

    show(json.dumps(Profile.model_json_schema(), indent=2))


def _flat(prefix: str, value: object) -> list[tuple[str, object]]:
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        items = [(str(item.get("name", i)), item) for i, item in enumerate(value)]
    else:
        return [(prefix, value)]
    lines: list[tuple[str, object]] = []
    for key, item in items:
        lines += _flat(f"{prefix}.{key}" if prefix else str(key), item)
    return lines
