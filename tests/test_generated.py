"""Files that are generated and committed are what their generator writes."""

from golden import params
from golden.formats import REFERENCE
from tests import module_table
from tests.builds import ROOT
from tests.mutation import page


def test_params_header_is_up_to_date():
    assert (ROOT / "rtl" / "gs_params.vh").read_text() == params.verilog_header(REFERENCE), "run `make params`"


def test_module_table_is_up_to_date():
    assert module_table.TARGET.read_text() == module_table.page(), "run `make docs`"


def test_mutation_page_is_up_to_date():
    assert page.TARGET.read_text() == page.text(page.load()), "run `python -m tests.mutation.page`"
