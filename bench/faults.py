"""What is wrong with a document, in words for the person who wrote it."""

from pydantic import ValidationError
from pydantic_core import ErrorDetails


def first_fault(error: ValidationError) -> tuple[ErrorDetails, str]:
    """The first fault, and what it is: what is wrong there, and how many more there are."""
    faults = error.errors(include_url=False)
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return faults[0], f"{_in_words(faults[0])}{more}"


def _in_words(fault: ErrorDetails) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            return "there is no such key; is it spelt right?"
        case "union_tag_invalid":
            named = str(context["discriminator"]).strip("'")
            return f"{named} {context['tag']!r} is none of {context['expected_tags']}"
        case _:
            return fault["msg"].removeprefix("Value error, ")
