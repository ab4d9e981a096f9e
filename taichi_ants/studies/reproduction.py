"""Archives of finished studies, which contain all that repeats them, and their reproduction."""

from __future__ import annotations

import platform
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from taichi_ants import __version__, files
from taichi_ants.errors import AntsError, count, shown
from taichi_ants.files import bundles, inputs
from taichi_ants.files.results import (
    MANIFEST,
    PAGE,
    UNFINISHED,
    ResultFolder,
    manifest_in,
    read_manifest,
)
from taichi_ants.studies.provenance import packages, source

RESULTS = "results/"  # begins the names of the files of a results folder in an archive
COMMANDS = ("sweep", "compare", "colony")
_SOURCE = re.compile(rb"(<dt>(Command|Finished|Commit|Versions|Machine|Time)</dt><dd>).*?</dd>")
_SHOWN = 5  # versions that differ, at most, in a message


def checked_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder of finished results, all of whose files are unchanged.

    Raises:
        AntsError: The folder has no finished results of this version, a file is missing or has
            changed, or its command cannot be repeated.
    """
    manifest = manifest_in(folder)
    if not manifest:
        if work := manifest_in(folder / UNFINISHED):
            is_shard = work.get("options", {}).get("shard")
            finish = (
                "join all shards with `taichi-ants merge`" if is_shard else "run its command again"
            )
            raise AntsError(
                f"{str(folder)!r} has unfinished work; {finish} to finish it, then archive it."
            )
        raise AntsError(f"{str(folder)!r} has no results; name the folder of a finished study.")
    version = manifest["settings"].get("version")
    if version != __version__ or "asked" not in manifest:
        written = f"version {version}" if version != __version__ else "an older state"
        raise AntsError(
            f"{str(folder)!r} has results of {written} of this package, and this is {__version__}; "
            "archive it with that version, or run the command again with --force."
        )
    if manifest["asked"]["command"] not in COMMANDS:
        raise AntsError(
            f"{str(folder)!r} has results of another kind; name a folder of a sweep, a comparison "
            "or a colony study."
        )
    ResultFolder(folder, manifest["settings"]).check()
    return manifest


def write_archive(path: Path, folder: Path, manifest: Mapping[str, Any], odd: str) -> None:
    """Write the archive of checked results; `odd` is the description of the model."""
    contents: dict[str, Path | str] = {
        f"{RESULTS}{name}": folder / name for name in (*manifest["files"], MANIFEST)
    }
    contents |= {"ODD.md": odd, "requirements.txt": lock(manifest)}
    contents["README.md"] = _readme(manifest)
    facts = {name: manifest[name] for name in ("command", "finished")}
    bundles.write(path, contents, {"version": __version__, **facts})


def lock(manifest: Mapping[str, Any]) -> str:
    """Return the packages of a run with exact versions, in the format of pip's requirements."""
    others = {n: one for n, one in manifest["packages"].items() if n != "taichi_ants"}
    own = f"taichi-ants=={manifest['packages']['taichi_ants']}"
    if manifest["commit"]:
        changed = "" if manifest["clean"] else ", with changes that are not committed"
        own = f"# {own} ran from its source, commit {manifest['commit']}{changed}"
    lines = [f"# Python {manifest['python']}", own, *(f"{n}=={v}" for n, v in others.items())]
    return "".join(f"{line}\n" for line in lines)


def _readme(manifest: Mapping[str, Any]) -> str:
    given = "".join(
        f"- `{RESULTS}{place}`, read from `{path}`\n" for path, place in manifest["inputs"].items()
    )
    return f"""# Archive of a study with Taichi Ants

The results come from this command, which finished {manifest["finished"]}:

    {manifest["command"]}

To compute them again and compare every file, install the versions in `requirements.txt` and run
this command with the name of this archive:

    taichi-ants reproduce FILE

- `ODD.md` describes the model of this study by the ODD protocol (Grimm et al. 2020).
- `requirements.txt` has the versions of all packages that the study used.
- `{RESULTS}` has the results. Its `{MANIFEST}` has the settings, the processor and the checksums.
- `{bundles.INDEX}` has the size and the SHA-256 of every file of this archive.
{given and f"{chr(10)}The study has read these files:{chr(10)}{chr(10)}{given}"}"""


def plugins_of(manifest: Mapping[str, Any]) -> list[str]:
    """Return the names in a bundle of the plugin and its imports, which its study runs."""
    plugin, given = manifest["asked"]["options"].get("plugin"), manifest["inputs"].items()
    return [RESULTS + n for p, n in given if plugin and (p == plugin or n.endswith(".py"))]


def manifest_of(bundle: bundles.Bundle) -> dict[str, Any]:
    """Return the manifest in a bundle; AntsError if it does not fit the files of the bundle."""
    with tempfile.TemporaryDirectory() as place:
        if RESULTS + MANIFEST not in bundle.names:
            raise AntsError(
                f"{files.named(bundle.path)} has no {RESULTS}{MANIFEST}; get another copy of it."
            )
        bundle.unpack(RESULTS + MANIFEST, Path(place, MANIFEST))
        manifest: dict[str, Any] = {}
        with suppress(AntsError):
            manifest = read_manifest(Path(place))
    try:
        known = manifest["asked"]["command"] in COMMANDS
        known &= {RESULTS + name for name in (MANIFEST, *manifest["files"])} == {
            name for name in bundle.names if name.startswith(RESULTS)
        }
        for name, checksum in manifest["files"].items():
            known = known and bundle.checksum_of(RESULTS + name) == checksum
        known = known and {*manifest["inputs"].values()} <= manifest["files"].keys()
        options = manifest["asked"]["options"]
        read = [options.get(name) for name in ("file", "plugin")]
        known = known and all(path is None or path in manifest["inputs"] for path in read)
        known = known and (read[0] is not None) == (manifest["asked"]["command"] == "sweep")
        texts = [manifest[name] for name in ("python", "command", "finished")]
        texts += [manifest["commit"] or "", *manifest["packages"].values()]
        known = known and all(isinstance(one, str) for one in texts)
        known = known and isinstance(manifest["settings"], dict) and "clean" in manifest
    except (LookupError, TypeError, AttributeError):
        known = False
    if not known:
        raise AntsError(
            f"the manifest in {files.named(bundle.path)} does not fit its files; get another copy "
            "of it."
        )
    return manifest


@contextmanager
def unpacked(bundle: bundles.Bundle, manifest: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the options of the command in a bundle, while the package reads the bundle's inputs."""
    options = dict(manifest["asked"]["options"])
    with ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        copies = {
            path: bundle.unpack(RESULTS + name, place / folder / Path(name).name)
            for number, (path, name) in enumerate(manifest["inputs"].items())
            for folder in ["code" if name.endswith(".py") else str(number)]
        }
        if options.get("plugin"):  # worker processes read it too
            options["plugin"] = str(copies.pop(options["plugin"]))
        if options.get("file"):
            options["file"] = Path(options["file"])
        stack.enter_context(inputs.replaced(copies))
        yield options


def other_versions(manifest: Mapping[str, Any]) -> str:
    """Return which versions of this process differ from those of a run, in words; "" if none do."""
    there: dict[str, Any] = {"Python": manifest["python"], **manifest["packages"]}
    here: dict[str, Any] = {"Python": platform.python_version(), **packages()}
    for name in there.keys() - here.keys():  # those that this process has not imported yet
        with suppress(metadata.PackageNotFoundError):
            here[name] = metadata.version(name)
    names = {n: n.replace("taichi_ants", "taichi-ants") for n in there}
    found = [
        f"{names[n]} {here.get(n, 'is missing')} instead of {one}"
        for n, one in there.items()
        if here.get(n) != one
    ]
    own, other = (_state(one) for one in (source(), manifest))
    if own and other and own != other:
        found.append(f"the source at {own} instead of {other}")
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return f"{', '.join(found[:_SHOWN])}{more}"


def _state(facts: Mapping[str, Any]) -> str:
    """Return the commit of a source, and whether it was changed, in words."""
    changed = "" if facts["clean"] else " with changes"
    return f"commit {facts['commit'][:12]}{changed}" if facts["commit"] else ""


class Compared(NamedTuple):
    """A file of the results: its name, and its difference in words, "" if it is equal."""

    name: str
    difference: str = ""
    note: str = ""


def compare(
    bundle: bundles.Bundle, manifest: Mapping[str, Any], folder: Path
) -> Iterator[Compared]:
    """Yield each file of the results in a bundle and in a folder, with its first difference.

    Pages and manifests name the command, the time or the machine of a run. These facts may differ.
    """
    made = read_manifest(folder)
    for name in sorted({*manifest["files"], *made["files"]}):
        if name not in made["files"]:
            yield Compared(name, "is only in the archive")
        elif name not in manifest["files"]:
            yield Compared(name, "is not in the archive")
        elif made["files"][name] == manifest["files"][name]:
            yield Compared(name)
        elif name in _WITHOUT_RUN and _WITHOUT_RUN[name](
            bundle.read(RESULTS + name)
        ) == _WITHOUT_RUN[name]((folder / name).read_bytes()):
            yield Compared(name, note="except the time and the machine of the run")
        else:
            with bundle.open(RESULTS + name) as one, files.opened(folder / name) as other:
                yield Compared(name, bundles.first_difference(one, other))
    own, other = manifest["settings"], made["settings"]
    different = [one for one in {**own, **other} if own.get(one) != other.get(one)]
    words = f"settings differ: {', '.join(different)}" if different else ""
    yield Compared(MANIFEST, words, "its settings")


_WITHOUT_RUN = {  # functions of the content of a file that leave out the facts about the run
    PAGE: partial(_SOURCE.sub, rb"\1</dd>"),
}


def plugins_in_words(bundle: bundles.Bundle, names: list[str]) -> str:
    """Return the names, sizes and checksums of plugins."""
    several = []
    for name in names:
        lines = bundle.read(name).count(b"\n")
        several.append(
            f"{shown(name)} ({count(lines, 'line')}, SHA-256 {bundle.checksum_of(name)[:16]}...)"
        )
    return ", ".join(several)
