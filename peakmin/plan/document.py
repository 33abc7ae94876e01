"""A plan as a JSON document of version 3: what its file states. `peakmin.verify` finds out whether that is true."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, TypeAdapter, field_serializer

from ..errors import SpecError
from ..geometry.costate import CostateTrajectory
from ..geometry.trajectory import HoldTrajectory, Trajectory
from ..proofs.bounds import Leaf, Proof
from ..robots.joint_motion import CentreMotion
from ..robots.joint_space import FLOODS
from ..scenes.arm_proof import ALL, ArmProof, Lined, PassageProof, Touching
from ..scenes.blocks import BlockClasses, BlockProof, ListedBranch, ListedProof, Marks, WayClass
from ..scenes.cells import Way
from ..scenes.passages import Edge, Line, Looks, Passage, Whole
from ..scenes.proof_tree import Branch
from ..spec.maneuver import Maneuver
from ..spec.model import LARGEST, Model, Switch
from ..spec.obstacles import Wall
from ..spec.reading import short
from ..spec.spec import ArmSpec, Spec
from ..types import Array, Json

VERSION: Literal[3] = 3  # of plan documents
SAMPLES = 200  # panels of the samples that a costate plan lists beside its closed form

Real = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Size = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]  # from zero up
Share = Annotated[float, Field(strict=True, ge=0, le=1)]  # of the duration
Whole0 = Annotated[int, Field(strict=True, ge=0)]
Rows = list[list[Real]]
Status = Literal["solved", "feasible", "infeasible", "unknown"]


class LeafDocument(Model):
    """A box of obstacle times and multipliers, (2+q, d), found at other times: a bound."""

    low: list[Share]
    high: list[Share]
    multipliers: Rows
    at: list[Share]

    @classmethod
    def of(cls, leaves: Sequence[Leaf]) -> list[Self]:
        return [
            cls(low=list(x.low), high=list(x.high), multipliers=x.multipliers.tolist(), at=list(x.at)) for x in leaves
        ]


class LeavesProof(Model):
    """Of walls alone: leaves that cover all obstacle times, or the plan's."""

    kind: Literal["walls"]
    leaves: list[LeafDocument]


class WayBranch(Model):
    """Of the paths with some ways past blocks: leaves past walls on lines, and the same for each gap of a strip."""

    lines: list[tuple[Real, Whole0]]
    leaves: list[LeafDocument]
    strip: Whole0 | None
    children: list[WayBranch | None]

    @classmethod
    def of(cls, branch: Branch[int, Marks]) -> Self:
        children = [None if child is None else cls.of(child) for child in branch.children]
        leaves = LeafDocument.of(branch.leaves)
        return cls(lines=list(branch.looks), leaves=leaves, strip=branch.cut, children=children)


class BlocksProof(Model):
    """Of blocks: a tree that covers every way past them."""

    kind: Literal["blocks"]
    root: WayBranch


class WayLeaves(Model):
    """The gaps of a way by strip, the lines with walls, and the leaves past them."""

    way: list[list[Whole0]]
    lines: list[tuple[Real, Whole0]]
    leaves: list[LeafDocument]


class ListProof(Model):
    """Of blocks, as files of version 1 have it: branches that cover every way past them."""

    kind: Literal["listed"]
    branches: list[WayLeaves]


class LineBranch(Model):
    """Of an arm's paths in one order: leaves, and the same for each gap and place of a line, (angle, offset)."""

    ends: tuple[Switch, Switch]
    dropped: list[Whole0]
    leaves: list[LeafDocument]
    line: tuple[Real, Real] | None
    children: list[LineBranch | None]

    @classmethod
    def of(cls, branch: Lined) -> Self:
        return cls(
            ends=branch.looks.ends,
            dropped=list(branch.looks.dropped),
            leaves=LeafDocument.of(branch.leaves),
            line=None if branch.cut is None else (branch.cut.angle, branch.cut.offset),
            children=[None if child is None else cls.of(child) for child in branch.children],
        )


class TouchingDocument(Model):
    """Of paths that touch an arc of an edge."""

    edge: Edge
    arc: tuple[Real, Real]
    leaves: list[list[LeafDocument]]


class PassageDocument(Model):
    """Of one start and one goal configuration."""

    indices: tuple[Whole0, Whole0]
    kept: LineBranch | None
    whole: LineBranch | None
    touching: list[TouchingDocument]


class ArmsProof(Model):
    """Of an arm's motions: all passages, but those that a flood of joint space with so many cells rules out."""

    kind: Literal["arm"]
    passages: list[PassageDocument]
    cells: Whole0


class CostateDocument(Model):
    """A control in closed form: see `CostateTrajectory`."""

    nodes: list[Real]
    first: Rows
    last: Rows
    size: list[Size]
    first_error: Rows
    last_error: Rows


class PathDocument(Model):
    """How the joints follow the centre of mass: see `JointPath`; others: knots [s] and angles [rad] of the rest."""

    pair: tuple[Whole0, Whole0]
    elbow: Literal[-1, 1]
    changes: list[Real]
    others: tuple[list[Real], Rows] | None


class HeldDocument(Model):
    """Joint accelerations [rad/s^2] held between nodes [s], from these joint angles [rad] on: see `JointMotion`."""

    nodes: list[Real]
    begin: list[Real]
    held: Rows


class ExtremesDocument(Model):
    """What the joints do at most at any instant [rad, rad/s, rad/s^2, N m]; null where it is not bounded."""

    low: list[Real | None]
    high: list[Real | None]
    speed: list[Real | None]
    acceleration: list[Real | None]
    torque: list[Real | None]
    singular: Real


class SensitivitiesDocument(Model):
    """Derivatives of the least peak; null where they are not known."""

    tips: list[list[Real | None]]
    obstacle_times: list[Real | None]
    duration: Real | None
    start_position: list[Real | None]
    start_velocity: list[Real | None]
    goal_position: list[Real | None]
    goal_velocity: list[Real | None]


class MadeDocument(Model):
    """How the plan was made: no part of what is verified."""

    solver: str
    compilations: Whole0
    solves: Whole0
    nodes: Whole0
    seconds: Real
    versions: dict[str, str]
    stopped: Switch


class PlanDocument(Model):
    """What every plan's document states: numbers in SI units, null where they are not known."""

    kind_of_file: ClassVar[str] = "plan"

    version: Literal[3]
    status: Status
    peak: Size | None
    lower_bound: Size | None
    gap: Real
    scope: Literal["all", "these"]
    peak_force: Size | None
    obstacle_times: list[Real]
    clearance: Real | None
    times: list[Real]
    position: Rows
    velocity: Rows
    acceleration: Rows
    costate: CostateDocument | None
    walls: list[Wall]
    digest: str
    made: MadeDocument

    @field_serializer("walls")
    def _plain_walls(self, walls: list[Wall]) -> list[Json]:
        return [plain(wall) for wall in walls]

    def motion(self, maneuver: Maneuver) -> Trajectory | None:
        """The motion that is listed, from the maneuver's start. Raises `ValueError` where it is none."""
        start = np.array(maneuver.start.position), np.array(maneuver.start.velocity)
        if not self.times:
            return None
        d = len(start[0])
        if self.costate is None:
            nodes = np.array(self.times)
            return HoldTrajectory(nodes, shaped(self.acceleration, len(nodes) - 1, d), *start)
        stated, k = self.costate, len(self.costate.nodes) - 1
        return CostateTrajectory(
            np.array(stated.nodes),
            shaped(stated.first, k, d),
            shaped(stated.last, k, d),
            shaped(stated.size, k),
            shaped(stated.first_error, k, d),
            shaped(stated.last_error, k, d),
            *start,
        )


class PointDocument(PlanDocument):
    """The plan of a centre of mass."""

    kind: Literal["point"]
    multipliers: Rows
    sensitivities: SensitivitiesDocument
    proof: Annotated[LeavesProof | BlocksProof | ListProof, Field(discriminator="kind")]
    spec: Spec

    @field_serializer("spec")
    def _plain(self, spec: Spec) -> Json:
        return plain(spec)


class ArmDocument(PlanDocument):
    """The plan of an arm."""

    kind: Literal["arm"]
    indices: tuple[Whole0, Whole0]
    contacts: list[str]
    exceeded: list[str]
    joints: Rows
    path: PathDocument | None
    held: HeldDocument | None
    peak_moment: Size | None
    extremes: ExtremesDocument | None
    proof: ArmsProof
    spec: ArmSpec

    @field_serializer("spec")
    def _plain(self, spec: ArmSpec) -> Json:
        return plain(spec)


def schema() -> Json:
    """The JSON Schema of a plan file."""
    either = Annotated[PointDocument | ArmDocument, Field(discriminator="kind")]
    return TypeAdapter[PointDocument | ArmDocument](either).json_schema()


# writing


def motion_fields(motion: Trajectory | None, duration: float) -> Json:
    """What a document lists of a motion: a hold motion's nodes, or even samples beside a closed form."""
    if motion is None:
        return dict.fromkeys(("times", "position", "velocity", "acceleration"), ()) | {"costate": None}
    held, joined = isinstance(motion, HoldTrajectory), isinstance(motion, CentreMotion)
    t = motion.nodes if held or joined else np.union1d(motion.nodes, duration * np.arange(SAMPLES + 1) / SAMPLES)
    return {
        "times": t.tolist(),
        "position": motion.position(t).tolist(),
        "velocity": motion.velocity(t).tolist(),
        "acceleration": motion.acceleration(t[:-1] if held else t).tolist(),
        "costate": None if held or joined else _costate(motion),
    }


def _costate(motion: Trajectory) -> CostateDocument:
    return CostateDocument(**{name: getattr(motion, name).tolist() for name in CostateDocument.model_fields})


def plain(model: Model) -> Json:
    """A part of a spec as its file has it: what is not given is left out."""
    data: Json = json.loads(model.to_json())
    return data


def known(value: float) -> float | None:
    """A number, or None where it is not finite."""
    return float(value) if math.isfinite(value) else None


def knowns(value: Array | float) -> list[object] | float | None:
    """Numbers as lists, those that are none as None."""
    found: list[object] | float | None = np.where(np.isnan(value), None, value).tolist()  # type: ignore[call-overload]
    return found


def proof_document(proof: Proof | BlockProof | ListedProof) -> LeavesProof | BlocksProof | ListProof:
    """What a document states of a proof."""
    if isinstance(proof, BlockProof):
        return BlocksProof(kind="blocks", root=WayBranch.of(proof.root))
    if isinstance(proof, ListedProof):
        listed = [
            WayLeaves(way=[list(gaps) for gaps in one.way], lines=list(one.lines), leaves=LeafDocument.of(one.leaves))
            for one in proof.branches
        ]
        return ListProof(kind="listed", branches=listed)
    return LeavesProof(kind="walls", leaves=LeafDocument.of(proof.leaves))


def arm_proof_document(proof: ArmProof) -> ArmsProof:
    """What a document states of an arm's proof."""

    def touching(one: Touching) -> TouchingDocument:
        return TouchingDocument(edge=one.edge, arc=one.arc, leaves=[LeafDocument.of(own) for own in one.leaves])

    def passage(one: PassageProof) -> PassageDocument:
        trunks = [None if tree is None else LineBranch.of(tree) for tree in (one.kept, one.whole)]
        every = [touching(each) for each in one.touching]
        return PassageDocument(indices=one.indices, kept=trunks[0], whole=trunks[1], touching=every)

    return ArmsProof(kind="arm", passages=[passage(one) for one in proof.passages], cells=proof.cells)


D = TypeVar("D", bound=PlanDocument)


def signed(made_as: type[D], **fields: Any) -> Json:
    """The document with these fields as plain data, with its digest."""
    data: Json = made_as(version=VERSION, digest="", **fields).model_dump(mode="json")
    made = data.pop("made")
    data["digest"] = digest(data)
    data["made"] = made
    return data


def digest(data: Json) -> str:
    """SHA-256 of everything but the digest and how the plan was made."""
    kept = {key: value for key, value in data.items() if key not in ("digest", "made")}
    return hashlib.sha256(json.dumps(kept, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


# reading


P = TypeVar("P")


def made_of(kind: type[D], made: Callable[[D], P], data: Json) -> P:
    """What `made` makes of the data of a document of this kind. Raises `SpecError` in one line where it is none."""
    try:
        with np.errstate(all="ignore"):  # a number that is none fails every comparison that it enters
            return made(kind(**data))
    except SpecError as error:
        said = str(error)
        raise SpecError(said if said.startswith("the document") else f"the document: was not a plan ({said})") from None
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError) as error:
        raise SpecError(f"the document: was not a plan ({type(error).__name__}: {short(str(error), 120)})") from None


def unknown(value: float | None) -> float:
    """A stated number; infinite where it is not known."""
    return math.inf if value is None else value


def shaped(value: Sequence[object], *shape: int) -> Array:
    """Numbers as an array of this shape. Raises `ValueError` where they are not of it."""
    found = np.array(value, dtype=float)
    if not found.size and not math.prod(shape):
        return found.reshape(shape)
    if found.shape != shape:
        raise ValueError(f"an array is of shape {found.shape}, not {shape}")
    return found


def leaves_of(leaves: Sequence[LeafDocument], walls: int, d: int) -> tuple[Leaf, ...]:
    """Leaves of so many walls in d dimensions. Raises `ValueError` where they are of others."""
    for leaf in leaves:
        if not len(leaf.low) == len(leaf.high) == len(leaf.at) == walls:
            raise ValueError("a leaf of the proof is of other walls")
    return tuple(
        Leaf(tuple(one.low), tuple(one.high), shaped(one.multipliers, 2 + walls, d), tuple(one.at)) for one in leaves
    )


def point_proof_of(
    stated: LeavesProof | BlocksProof | ListProof,
    scope: Literal["all", "these"],
    classes: BlockClasses | None,
    walls: int,
    d: int,
) -> Proof | BlockProof | ListedProof:
    """The proof that a document states. Raises `ValueError` where it is none of these blocks, or walls."""
    if classes is None:
        if not isinstance(stated, LeavesProof):
            raise ValueError("the proof is of blocks, and there are none")
        return Proof(scope, leaves_of(stated.leaves, walls, d))
    if scope != "all":
        raise ValueError("the proof past blocks is of all times")
    if isinstance(stated, BlocksProof):
        return BlockProof(_way_branch(stated.root, classes, classes.cells.ways, d))
    if isinstance(stated, ListProof):
        return ListedProof(tuple(_listed(one, classes, d) for one in stated.branches))
    raise ValueError("the proof is of walls alone, and there are blocks")


def _listed(one: WayLeaves, classes: BlockClasses, d: int) -> ListedBranch:
    way = tuple(tuple(gaps) for gaps in one.way)
    cells = classes.cells
    if len(way) != len(cells.gaps) or any(
        g >= len(there) for gaps, there in zip(way, cells.gaps, strict=True) for g in gaps
    ):
        raise ValueError("a way of the proof is not through these blocks")
    kept = cells.through(way)
    return ListedBranch(way, _lines(one.lines, classes), leaves_of(one.leaves, _walls(kept, one.lines, classes), d))


def _lines(lines: Sequence[tuple[float, int]], classes: BlockClasses) -> Marks:
    if any(not classes.cells.has(line) for line in lines):
        raise ValueError("a line of the proof is not between start and goal")
    return tuple(lines)


def _walls(way: Way | None, lines: Sequence[tuple[float, int]], classes: BlockClasses) -> int:
    return 0 if way is None else len(classes.cells.marks(way, tuple(lines)))


def _way_branch(one: WayBranch, classes: BlockClasses, way: Way | None, d: int) -> Branch[int, Marks]:
    lines = _lines(one.lines, classes)
    leaves = leaves_of(one.leaves, _walls(way, lines, classes), d) if one.leaves else ()
    if one.strip is None or way is None:
        return Branch(leaves, lines)
    if not classes.splits(WayClass(way, lines), one.strip):
        raise ValueError("a strip of the proof is none of these blocks")
    parts = classes.parts(WayClass(way, lines), one.strip)
    children = [
        None if child is None else _way_branch(child, classes, part, d)
        for part, child in zip(parts, one.children, strict=True)
    ]
    return Branch(leaves, lines, one.strip, tuple(children))


def arm_proof_of(stated: ArmsProof, passages: Mapping[tuple[int, int], Passage]) -> ArmProof:
    """The proof that a document states. Raises `ValueError` where it is none of these passages."""
    more = any(one.workspace.chain.links > 2 for one in passages.values())
    if stated.cells not in (0, *FLOODS) or (stated.cells and more):
        raise ValueError("cells of a flood are not as many as one has")
    return ArmProof(tuple(_passage(one, passages) for one in stated.passages), stated.cells)


def _passage(one: PassageDocument, passages: Mapping[tuple[int, int], Passage]) -> PassageProof:
    if one.indices not in passages:
        raise ValueError("a proof is of configurations that are none")
    passage = passages[one.indices]
    if passage.workspace.chain.links > 2:
        if one.whole is None:
            raise ValueError("a proof is missing")
        return PassageProof(
            one.indices, None, (), Branch(leaves_of(one.whole.leaves, 0, passage.maneuver.dimension), Looks())
        )
    touching = tuple(_touching(each, passage) for each in one.touching)
    trunks = [
        None if tree is None else _line_branch(tree, seen, ALL)
        for tree, seen in ((one.kept, passage), (one.whole, passage.whole))
    ]
    return PassageProof(one.indices, trunks[0], touching, trunks[1])


def _touching(one: TouchingDocument, passage: Passage) -> Touching:
    touched = Touching(one.edge, one.arc, ())
    if len(one.leaves) != len(touched.paths):
        raise ValueError("an arc's leaves are missing")
    pasts = [passage.past(paths) for paths in touched.paths]
    d = passage.maneuver.dimension
    leaves = tuple(
        leaves_of(own, 0 if past is None else len(past.walls), d) for own, past in zip(one.leaves, pasts, strict=True)
    )
    return Touching(one.edge, one.arc, leaves)


def _line_branch(one: LineBranch, passage: Passage, part: Whole) -> Lined:
    looks = Looks(one.ends, tuple(one.dropped))
    order = passage.seen(part, looks)
    past = passage.past(order)
    leaves = leaves_of(one.leaves, 0 if past is None else len(past.walls), passage.maneuver.dimension)
    if one.line is None:
        return Branch(leaves, looks)
    line = Line(*one.line)
    if not passage.splits(order, line):
        raise ValueError("a line is not between start and goal")
    parts = passage.parts(order, line)
    children = [
        None if child is None else _line_branch(child, passage, each)
        for each, child in zip(parts, one.children, strict=True)
    ]
    return Branch(leaves, looks, line, tuple(children))
