"""From a sentence for people to one of a page."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from calib.visible import visible

# What is to be typed, in a sentence.
_TYPED = re.compile(r"`([^`\n]+)`")


def sentence(text: str) -> Markup:
    """Write a sentence for a page, in which what stands between backticks is code; all else is escaped.

    Parameters
    ----------
    text : as people are told.

    >>> print(sentence("Hold <it> against `calib compare`."))
    Hold &lt;it&gt; against <code>calib compare</code>.
    """
    return Markup(_TYPED.sub(r"<code>\1</code>", str(escape(visible(text)))))
