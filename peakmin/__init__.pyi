"""The public names and where they are; `__init__.py` hands them on as they are first asked for."""

from .errors import NotDPPError as NotDPPError
from .errors import PeakminError as PeakminError
from .errors import SpecError as SpecError
from .plan.arm_plan import ArmPlan as ArmPlan
from .plan.found import Made as Made
from .plan.plan import Plan as Plan
from .plan.verify import Verification as Verification
from .plan.verify import verify as verify
from .programs.program import DirectProgram as DirectProgram
from .programs.program import FeasibilityProgram as FeasibilityProgram
from .proofs.bounds import Leaf as Leaf
from .proofs.bounds import Proof as Proof
from .proofs.bracket import Answer as Answer
from .proofs.bracket import Bracket as Bracket
from .proofs.bracket import HoldProblem as HoldProblem
from .proofs.bracket import Verdict as Verdict
from .proofs.check import Check as Check
from .proofs.sensitivity import Sensitivities as Sensitivities
from .queries.budget import ErrorBudget as ErrorBudget
from .queries.budget import error_budget as error_budget
from .queries.explain import explain as explain
from .queries.oracle import PeakOracle as PeakOracle
from .queries.oracle import Peaks as Peaks
from .queries.shortest import Shortest as Shortest
from .queries.shortest import shortest as shortest
from .queries.study.study import study as study
from .queries.study.table import Study as Study
from .search.solve import solve as solve
from .search.sweep import Sweep as Sweep
from .search.sweep import sweep as sweep
from .spec.arm import Arm as Arm
from .spec.arm import ArmManeuver as ArmManeuver
from .spec.arm import Link as Link
from .spec.arm import Pose as Pose
from .spec.control_set import Disc as Disc
from .spec.control_set import Polygon as Polygon
from .spec.frame import Frame as Frame
from .spec.maneuver import Maneuver as Maneuver
from .spec.maneuver import State as State
from .spec.obstacles import Block as Block
from .spec.obstacles import Wall as Wall
from .spec.settings import (
    Aligned as Aligned,
)
from .spec.settings import (
    Bisection as Bisection,
)
from .spec.settings import (
    Direct as Direct,
)
from .spec.settings import (
    Exact as Exact,
)
from .spec.settings import (
    GlobalSearch as GlobalSearch,
)
from .spec.settings import (
    RefineSearch as RefineSearch,
)
from .spec.settings import (
    Settings as Settings,
)
from .spec.settings import (
    SweepSearch as SweepSearch,
)
from .spec.settings import (
    Uniform as Uniform,
)
from .spec.spec import ArmSpec as ArmSpec
from .spec.spec import Spec as Spec
from .spec.spec import schema as schema
from .spec.study import StudySpec as StudySpec

__version__: str
