"""What a section of the report is made from, `Results`, and what it is, a `Section`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from calib.checks import Member, Prediction, Reason, Verdict
from calib.decision import NextInShort, Recommendation
from calib.report.pictures import Drawing, Picture, Plot
from calib.sampling import Posterior

#: Plots of the signal: as it was measured, along the padding, and of what meets a specification.
CHANGE, PADDING, CONFORMITY = "change", "padding", "conformity"


@dataclass(frozen=True, eq=False)
class Results:
    """The results of a calibration that the sections of a report are made from.

    Attributes
    ----------
    posterior : with its diagnostics.
    predictions : of each sweep, in the order of the posterior's sweeps.
    verdict : on the calibration.
    recommendation : of a padding; None if none was asked for.
    posterior_sha256 : hash of the file that the posterior is kept in; "" if it is not kept.
    plots : name -> figure of the report, of all sections; see `calib.report.sections`.
    drawings : name -> picture, drawn when it is called for, or before by a worker.
    members : the models that the posterior is an average of; none for one model.
    next_steps : what to measure next; None where nothing is said of it.
    """

    posterior: Posterior
    predictions: Sequence[Prediction]
    verdict: Verdict = field(default_factory=Verdict)
    recommendation: Recommendation | None = None
    posterior_sha256: str = ""
    plots: Mapping[str, Plot] = field(default_factory=dict)
    drawings: Mapping[str, Drawing] = field(default_factory=dict)
    members: Sequence[Member] = ()
    next_steps: NextInShort | None = None

    def picture(self, name: str) -> Picture:
        """One of `plots`, drawn, as part of a page."""
        return Picture(name, self.drawings[name](), self.plots[name].alt, self.plots[name].caption)

    @property
    def void(self) -> bool:
        """Whether there are no results: the verdict is red, and what the draws say only serves to find the cause."""
        return self.verdict.colour == "red"

    @property
    def against_advice(self) -> tuple[Reason, ...]:
        """What speaks against the advice alone: what speaks against the calibration, and so against it, too, is said once."""
        if self.recommendation is None or self.void:
            return ()
        return tuple(reason for reason in self.recommendation.verdict.reasons if reason not in self.verdict.reasons)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """All that speaks against the calibration, then what speaks against the advice alone."""
        return (*self.verdict.reasons, *self.against_advice)

    @property
    def stale(self) -> bool:
        """Whether the recommendation was made from other draws than these."""
        return self.recommendation is not None and self.recommendation.draws_sha256 != self.posterior.draws_sha256

    @property
    def signal_picture(self) -> str:
        """Name of the plot of the signal that stands on the first page, and nowhere else; "" where there is none."""
        if self.recommendation is None or self.void:
            return CHANGE if CHANGE in self.plots else ""
        return PADDING if self.recommendation.conformity is None else CONFORMITY


@dataclass(frozen=True, eq=False)
class Section:
    """One section of the report, ready to be laid out.

    Attributes
    ----------
    identifier : of its element on the page, where links lead.
    title : its heading; "" for none.
    link : its name in the list of contents; "" if it is not in there.
    template : the file in `calib/report/templates` that lays out what is below the heading.
    context : what that file asks for, by name.
    paper : whether it is for paper alone, where the first sheet has no room for what a screen shows there.
    appendix : whether it is for who checks the statistics: folded away at the end of the page, open on paper.
    of_draws : whether it shows what the draws say: where the verdict is red that is no result, and the page says so.
    """

    identifier: str
    title: str
    link: str
    template: str
    context: Mapping[str, object]
    appendix: bool = False
    paper: bool = False
    of_draws: bool = True
