"""A certificate in, its page for people out: one sheet of A4 where it fits, with what tells it from others at its foot."""

from __future__ import annotations

from collections.abc import Mapping

from calib.report.certificate import MEANT, NOT_ACCREDITED, Certificate
from calib.report.environment import templates


def certificate_page(certificate: Certificate, posterior_sha256: str, report_sha256: str) -> str:
    """Lay out a certificate as an HTML page that needs nothing beside itself and prints on A4.

    Parameters
    ----------
    certificate : as made.
    posterior_sha256, report_sha256 : of the files that it is of; "" for a report that is not there.

    Returns
    -------
    str
        The page; the same certificate gives the same bytes.
    """
    c = certificate
    name, digest = c.experiment
    hashes = {"posterior.nc": posterior_sha256, "report.html": report_sha256, "run": c.fingerprint, name: digest}
    template = templates().get_template("certificate.html.j2")
    return template.render(
        c=c,
        facts=_facts(c),
        meant=MEANT,
        accreditation=NOT_ACCREDITED,
        hashes={name: digest for name, digest in hashes.items() if digest},
        posterior=posterior_sha256,
    )


def _facts(c: Certificate) -> Mapping[str, str]:
    lab = c.laboratory
    facts = {
        "laboratory": ", ".join(part for part in (lab.name, lab.city, lab.country, lab.email) if part),
        "operator": lab.operator,
        "customer": lab.customer,
        "measured": _span(lab.measured, lab.measured_until),
        "specimens": ", ".join(c.specimens),
        "model": c.model,
        "forward model": "; ".join(c.origin.forward),
        "taken as known": ", ".join(known.shown for known in c.known),
        "calibrated with": ", ".join(f"{name} {version}" for name, version in c.calibrated_with.items()),
        "sampled": f"{_span(c.started[:10], c.ended[:10])}, seed {c.seed}" if c.started else f"seed {c.seed}",
    }
    return {name: fact for name, fact in facts.items() if fact}


def _span(first: str, last: str) -> str:
    return first if first == last else f"{first} to {last}"
