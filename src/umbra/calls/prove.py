"""``umbra.prove``: verdicts by rules, and the sheet that an office hands in."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ParamSpec, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.calls.prove_options import JudgedOptions, ProofOptions, take_study_options
from umbra.errors import InputError, check_type
from umbra.lights import Horizon
from umbra.rules.read import read_rule
from umbra.rules.record import Rule
from umbra.scene import Scene
from umbra.signatures import takes
from umbra.study.land import settle_land
from umbra.study.remarks import tell_proposal
from umbra.study.settled import settle_ground
from umbra.sun import Site
from umbra.verdicts import Gathered, Model, RuleVerdict, judge_rules
from umbra.verdicts.judge import spell_out

__all__ = ["Proof", "make_proof", "prove", "read_logo_of", "read_rules_of"]

P = ParamSpec("P")
_LISTED, _MOST_FILES = 8, 60  # files that the first page names, and the last


@dataclass(frozen=True, eq=False)
class Proof:
    """
    Verdicts on a model.

    Parameters
    ----------
    verdicts : list of RuleVerdict
        One for each rule, with ``rule``, ``verdict`` and ``findings``.
    ground : str
        What it is taken to be.
    """

    verdicts: list[RuleVerdict]
    gathered: Gathered
    options: ProofOptions
    ground: str = ""
    notes: tuple[str, ...] = ()
    spell: Callable[[str], str] = str
    logo: NDArray[np.uint8] | None = None

    @property
    def verdict(self) -> str:
        """``fail`` if a rule fails, else ``unknown`` if one is, else ``pass``."""
        words = [verdict.verdict for verdict in self.verdicts]
        return next((word for word in ("fail", "unknown") if word in words), "pass")

    def sum_up(self) -> dict[str, Any]:
        """Return the verdicts as JSON can hold them."""
        from umbra.writers.proof.rows import sum_up  # noqa: PLC0415

        zone = self.gathered.model.site.zone
        return {
            "verdict": self.verdict,
            "year": self.options.year,
            "rules": sum_up(self.verdicts, zone),
            "notes": list(self.notes),
        }

    def tell(self) -> list[str]:
        """Return a sentence for each rule."""
        from umbra.writers.proof.rows import tell_rule  # noqa: PLC0415

        return [tell_rule(verdict) for verdict in self.verdicts]

    def write(self, folder: str | Path) -> list[Path]:
        """
        Write ``proof.html``, ``proof.pdf``, ``verdicts.csv`` and ``conditions.csv``.

        Parameters
        ----------
        folder : path
            Made if missing; earlier results are replaced when the new ones are complete.

        Returns
        -------
        paths : list of Path
        """
        from umbra.folders.atomic import replace_results  # noqa: PLC0415

        out = Path(folder)
        with replace_results(out) as unfinished:
            names = self.fill(unfinished)
        return [out / name for name in names]

    def fill(self, folder: Path) -> list[str]:
        """Write the files into a folder that exists; return their names."""
        from umbra.writers.folder.captions import list_files, name_model  # noqa: PLC0415
        from umbra.writers.proof import ProofSheet, write_proof  # noqa: PLC0415

        options, model = self.options, self.gathered.model
        sheet = ProofSheet(
            title=options.title or name_model(list_files(model.scene)),
            project=options.project or "", author=options.author or "", number=options.number or "",
            logo=self.logo, paper=options.paper,
            basis=tuple(_list_basis(self)), facts=tuple(_list_facts(self)),
        )  # fmt: skip
        return write_proof(folder, self.gathered, self.verdicts, sheet)


class ProveCall(Protocol[P]):
    """The signature of ``umbra.prove``."""

    def __call__(
        self, scene: Scene, site: Site, rules: str | Path | Sequence[str | Path], *_: P.args,
        **options: P.kwargs,
    ) -> Proof: ...  # fmt: skip


def _take(_record: Callable[P, JudgedOptions]) -> Callable[[Any], ProveCall[P]]:
    return takes(ProofOptions, "a proof")


@_take(JudgedOptions)
def prove(
    scene: Scene, site: Site, rules: str | Path | Sequence[str | Path], *, options: ProofOptions
) -> Proof:
    """
    Judge a model by rules.

    Parameters
    ----------
    scene : Scene
    site : Site
    rules : str, path, or several
        Names of ``umbra.list_rules``, ``NAME:VARIANT``, or files.
    options : ProofOptions
        Each by its name.

    Returns
    -------
    proof : Proof
        With ``verdicts``, ``verdict``, ``tell()`` and ``write(folder)``.

    Raises
    ------
    InputError
        If a rule or an option is wrong.

    Examples
    --------
    >>> proof = umbra.prove(scene, site, "tno-light", windows="w.csv")  # doctest: +SKIP
    >>> proof.verdict  # doctest: +SKIP
    'pass'
    """
    check_type("scene", scene, Scene)
    check_type("site", site, Site)
    many = [rules] if isinstance(rules, (str, Path)) else list(rules)
    proof = make_proof(scene, site, replace(options, rules=tuple(map(str, many))))
    for note in proof.notes:
        warnings.warn(note, stacklevel=3)
    return proof


def make_proof(
    scene: Scene,
    site: Site,
    options: ProofOptions,
    rules: list[list[Rule]] | None = None,
    spell: Callable[[str], str] = str,
) -> Proof:
    """Judge a model by rules, with the options of a record; ``spell`` writes options' names."""
    if rules is None:
        rules = read_rules_of(options)
    logo = read_logo_of(options)  # before all that takes time
    study = settle_land(take_study_options(options), scene.model_bounds(), site)
    land = () if study.horizon is None else study.horizon.told
    ground = settle_ground(scene, study)
    remarks = tell_proposal(scene, study) if options.proposed else []
    if ground.scene.replaced:  # on the ground of what stood there, too
        scene = ground.scene
    model = Model(
        scene=scene, site=site, year=int(options.year or 0), options=study,
        proposed=tuple(options.proposed),
    )  # fmt: skip
    gathered = Gathered(
        model, areas=options.areas, windows=options.windows, plot=options.plot,
        roads=options.roads, areas_on=options.areas_on, reveal=options.reveal,
    )  # fmt: skip
    verdicts = spell_out(judge_rules(gathered, rules), spell)
    notes = tuple(dict.fromkeys(map(spell, (*remarks, *gathered.notes, *ground.notes, *land))))
    told = spell(str(ground.describe().get("assumption", ground.name)))
    return Proof(verdicts, gathered, options, told, notes, spell, logo)


def read_logo_of(options: ProofOptions) -> NDArray[np.uint8] | None:
    """Read the logo of a sheet, if there is one."""
    from umbra.writers.proof.logo import read_logo  # noqa: PLC0415

    return None if options.logo is None else read_logo(options.logo)


def read_rules_of(options: ProofOptions) -> list[list[Rule]]:
    """Read the rules that are named, each once."""
    names = [name for text in options.rules for name in _split(text)]
    if not names:
        msg = "a proof needs a rule; give rules='NAME', of those that 'umbra rules' lists"
        raise InputError(msg, option="rules")
    return [read_rule(name) for name in dict.fromkeys(names)]


def _split(text: str) -> list[str]:
    """Split names at commas, but not the path of a file."""
    if Path(text).exists() or "=" in text:
        return [text]
    return [word for word in text.split(",") if word]


def _list_basis(proof: Proof) -> list[tuple[str, str]]:
    """Return the facts of a sheet's first page."""
    options, model = proof.options, proof.gathered.model
    names = [Path(name).name for name, _ in _list_sources(proof)]
    if len(names) > _LISTED:
        names = [*names[:_LISTED], f"and {len(names) - _LISTED:,} more"]
    return [
        ("place", f"{model.site.show()}, {model.site.zone}"),
        ("dates", f"of {options.year}, where a rule names no year"),
        ("times", f"of the local clock, {model.site.zone}, where no other is named"),
        ("ground", proof.ground.partition(";")[0]),
        ("files", ", ".join(names) or "none"),
    ]


def _list_facts(proof: Proof) -> list[tuple[str, str]]:
    """Return the assumptions and files."""
    from umbra.version import __version__  # noqa: PLC0415

    options, model = proof.options, proof.gathered.model
    site = model.site
    casters = [
        f"{name.replace('_', ' ')}: {', '.join(getattr(options, name))}"
        for name in ("proposed", "replace", "cast", "no_cast", "canopy")
        if getattr(options, name)
    ]
    if gone := proof.gathered.name_replaced():
        casters.append(f"there before the proposal alone: {', '.join(gone)}")
    files = [f"{name}  SHA-256 {digest}" for name, digest in _list_files(proof)]
    if len(files) > _MOST_FILES:
        files = [*files[:_MOST_FILES], f"and {len(files) - _MOST_FILES:,} more"]
    return [
        (
            "place",
            f"{site.show()}, {site.zone}; true north at {_tell_angle(site.true_north)} in the plan",
        ),
        ("dates", f"those without a year are of {options.year}; times are of the local clock"),
        ("sun", "a point at its apparent position with standard refraction; rims at -0.833°"),
        ("ground", proof.ground),
        ("casters", "; ".join(casters) or "all parts of the model"),
        *([("land", _tell_land(model.options.horizon))] if model.options.horizon else []),
        ("not in it", "light reflected, glass, frames, and whatever the files do not have"),
        *([("notes", "\n".join(proof.notes))] if proof.notes else []),
        ("files", "\n".join(files) or "none"),
        ("made by", f"umbra {__version__}"),
    ]


def _tell_land(land: Horizon) -> str:
    """Describe the land around, which hides the sun and the sky."""
    return (
        f"{land.name} hides the sun and the sky, up to {land.highest:.1f}° above the horizon; not "
        "from what the proposal alone shades"
    )


def _tell_angle(degrees: float) -> str:
    """Describe an angle to a hundredth of a degree, far below what a plan can show."""
    return f"{round(degrees, 2) or 0.0:g}°"


def _list_files(proof: Proof) -> list[tuple[str, str]]:
    """Return the names and digests of the model's files, and of those named beside it."""
    import hashlib  # noqa: PLC0415

    files: list[tuple[str, str]] = []
    options = proof.options
    named = [
        options.areas,
        options.windows,
        options.plot,
        options.replace_in,
        options.sunshine,
        options.horizon,
        *options.rules,
    ]
    for item in named:
        path = Path(str(item)) if isinstance(item, (str, Path)) else None
        if path is not None and path.is_file():
            with path.open("rb") as file:
                files.append((path.name, hashlib.file_digest(file, "sha256").hexdigest()))
    return list(dict.fromkeys([*_list_sources(proof), *files]))


def _list_sources(proof: Proof) -> list[tuple[str, str]]:
    sources = proof.gathered.model.scene.sources
    return [(str(source.name), str(source.sha256)) for source in sources]
