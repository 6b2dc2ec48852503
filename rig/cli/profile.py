"""`rig profile`: the rigs that are described, and how to describe one."""

import json
from typing import Annotated

import typer

from rig.cli.next_verb import tell_next
from rig.cli.options import AsJson, Overrides, ProfileName
from rig.cli.output import show, show_json, table, tell
from rig.cli.profile_new import new_profile
from rig.cli.words import profile_names

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
    tell_next("profile list", as_json=False)


@app.command("show")
def show_profile(
    name: ProfileName, *, overrides: Overrides = None, as_json: AsJson = False
) -> None:
    """Print a profile as it will be used, as TOML that can be saved: defaults are filled in."""
    from rig.profile.load import find_profile, load_profile
    from rig.profile.toml_text import toml_text

    profile = load_profile(name, overrides or ())
    if as_json:
        show_json(profile.model_dump(mode="json"))
        return
    tell(f"{find_profile(name)}:")
    show(toml_text(profile).rstrip("\n"))
    tell_next("profile show", as_json=False, profile=name)


@app.command("check")
def check_profile(
    names: Annotated[
        list[str],
        typer.Argument(metavar="PROFILE", help="Names or paths.", autocompletion=profile_names),
    ],
    *,
    overrides: Overrides = None,
) -> None:
    """Check profiles for what needs no hardware.

    That they can be used at all (the first one that cannot ends with an error), that the sweep is
    inside the travel, that lengths can be mm, that files are there, and that no placeholder and no
    MEASURE is left. Exit code 3 says that something of this was found.
    """
    from rig.profile.doubts import doubts
    from rig.profile.load import find_profile, load_profile

    doubted: list[str] = []
    for name in names:
        profile = load_profile(name, overrides or ())
        found = doubts(profile, find_profile(name).read_text(encoding="utf-8"))
        verdict = f"{len(found)} to settle" if found else "good"
        views = "1 view" if len(profile.views) == 1 else f"{len(profile.views)} views"
        show(f"{name}: {verdict}; {views}, camera {profile.camera.kind}")
        for doubt in found:
            show(f"  {doubt}")
        doubted += [name] if found else []
    if doubted:
        tell(f"rig: to be settled before a run: {', '.join(doubted)}")
        tell_next("profile check, doubts", as_json=False, profile=doubted[0])
        raise typer.Exit(3)
    tell_next("profile check", as_json=False, profile=names[0])


@app.command("schema")
def show_schema() -> None:
    """Print the JSON Schema of profiles, for editors that complete and check TOML."""
    from rig.profile import Profile

    show(json.dumps(Profile.model_json_schema(), indent=2))
