"""The rules that umbra brings, listed."""

from umbra.rules.read import find_shipped, read_rule
from umbra.rules.record import Rule
from umbra.rules.words import STANDINGS

__all__ = ["describe_rule", "list_rules"]


def list_rules() -> list[Rule]:
    """
    Return the rules that umbra brings, by name; of one with variants its default, or the first.

    Returns
    -------
    rules : list of Rule
        Each with ``name``, ``title``, ``place``, ``edition``, ``asks``, ``source``, ``read``,
        ``standing`` and ``text``, the file to copy.
    """
    return [read_rule(name)[0] for name in find_shipped()]


def describe_rule(rules: list[Rule]) -> dict[str, object]:
    """Return a rule's facts for JSON, of all its variants."""
    rule = rules[0]
    facts = {
        key: getattr(rule, key)
        for key in (
            "name", "title", "place", "edition", "asks", "source", "read", "standing", "first_hand",
            "second_hand", "before_use",
        )
    }  # fmt: skip
    facts["standing_means"] = STANDINGS[rule.standing]
    facts["variants"] = {
        variant.variant: variant.about_variant for variant in rules if variant.variant
    }
    facts["receivers"] = sorted(
        {word for requirement in rule.requirements for word in requirement.receivers}
    )
    return facts
