"""Help of a command with many options: under headings, in the order of their declaration."""

import click

__all__ = ["make_sectioned"]

_WIDTH = 26  # of the options' names, alike in all sections


def make_sectioned(starts: dict[str, str]) -> type[click.Command]:
    """
    Make a command class whose help has sections.

    Parameters
    ----------
    starts : dict of str to str
        The long name of each section's first option, and the section's heading.
    """

    class Sectioned(click.Command):
        def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
            sections: dict[str, list[tuple[str, str]]] = {}
            heading = "Options"
            for parameter in self.get_params(ctx):
                heading = next((starts[o] for o in parameter.opts if o in starts), heading)
                record = parameter.get_help_record(ctx)
                if record is not None and isinstance(parameter, click.Option):
                    name, words = record
                    sections.setdefault(heading, []).append((name.ljust(_WIDTH), words))
            for name, records in sections.items():
                with formatter.section(name):
                    formatter.write_dl(records, col_max=_WIDTH + 2)

    return Sectioned
