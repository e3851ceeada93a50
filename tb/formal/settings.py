"""How each proof is made small: a stream's rule does not depend on the sizes that are reduced here."""

PARAMETERS: dict[str, dict[str, int]] = {
    "gs_skid": {"WIDTH": 8},
}
STEPS: dict[str, int] = {}  # longest induction tried, where it is not 8
