"""gs_axi_answers: a list is done when its last burst, and every one before it, is answered."""

import cocotb
from cocotb.triggers import RisingEdge

from tb.lib.stream import Monitor, Sink, cycle, reset, rng, start_clock

TOP = "gs_axi_answers"
PARAMETERS = [{"CNT_W": 5, "DONES": 2}, {"CNT_W": 12, "DONES": 8}]


@cocotb.test()
@cocotb.parametrize(stall=["none", "random", "burst", "three_of_four"])
async def test_done_comes_behind_the_last_answer_of_each_list(dut, stall):
    """Random lists of 0 to 3 bursts, a reference that counts without bounds. The small counter goes round often."""
    start_clock(dut)
    sink = Sink(dut, "done", ("n",), stall=stall)
    Monitor(dut, "done", ("n",))
    random = rng("answers", stall)
    numbers = [random.getrandbits(len(dut.fin_n)) for _ in range(61)]
    for name in ("burst", "fin_valid", "fin_n", "m_axi_bvalid", "m_axi_bresp"):
        getattr(dut, name).value = 0
    await reset(dut)
    sent = seen = 0
    lists, answers, fins = [], [], []  # bursts sent by each end; cycles
    left = random.randrange(4)
    while len(lists) < 60:
        burst = left > 0 and random.random() < 0.7
        fin = left - burst == 0 and random.random() < 0.7
        answer = seen < sent and random.random() < 0.6
        dut.burst.value, dut.fin_valid.value, dut.fin_n.value = burst, fin, numbers[len(lists)]
        dut.m_axi_bvalid.value = answer
        await RisingEdge(dut.clk)
        if answer:
            seen += 1
            answers.append(cycle())
        moved = fin and int(dut.fin_ready.value)
        if fin and not moved:  # offer it again, its burst has been counted
            while not moved:
                dut.burst.value, dut.m_axi_bvalid.value = 0, seen < sent + burst
                seen_now = seen < sent + burst
                await RisingEdge(dut.clk)
                if seen_now:
                    seen += 1
                    answers.append(cycle())
                moved = int(dut.fin_ready.value)
        sent += burst
        left -= burst
        if moved:
            lists.append(sent)
            fins.append(cycle())
            left = random.randrange(4)
    dut.burst.value, dut.fin_valid.value = 0, 0
    while len(sink.beats) < 60:
        dut.m_axi_bvalid.value = seen < sent
        answer = seen < sent
        await RisingEdge(dut.clk)
        if answer:
            seen += 1
            answers.append(cycle())
    assert [n for (n,) in sink.beats] == numbers[:60]
    for k, (count, fin, done) in enumerate(zip(lists, fins, sink.cycles, strict=True)):
        first = max(fin + 2, answers[count - 1] + 1 if count else 0, sink.cycles[k - 1] + 1 if k else 0)
        assert done == first if stall == "none" else done >= first
    assert dut.error.value == 0


@cocotb.test()
async def test_an_error_is_kept_until_reset(dut):
    start_clock(dut)
    dut.burst.value, dut.fin_valid.value, dut.m_axi_bvalid.value, dut.done_ready.value = 0, 0, 0, 0
    await reset(dut)
    for valid, answer, error in ((0, 2, 0), (1, 1, 0), (1, 2, 1), (1, 0, 1)):
        dut.m_axi_bvalid.value, dut.m_axi_bresp.value = valid, answer
        await RisingEdge(dut.clk)
        dut.m_axi_bvalid.value = 0
        await RisingEdge(dut.clk)
        assert dut.error.value == error
    await reset(dut)
    assert dut.error.value == 0
