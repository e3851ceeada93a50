"""Why what docs/mutation.md lists is no missing test. Entries are found by words of the source line."""

# unit: (part of the source line, part of the mutant's name, reason)
SURVIVORS: dict[str, list[tuple[str, str, str]]] = {}

# module: (part of the source line, reason)
NEVER_REACHED: dict[str, list[tuple[str, str]]] = {}
