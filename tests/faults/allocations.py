# SPDX-License-Identifier: Apache-2.0
"""What is left of a render in which an allocation fails, or that has no more memory from one on."""
import math
import pathlib
import tempfile

from workshop import DOCUMENTED, expect

HOW_MEMORY_FAILS = ["alone", "exhausted"]  # failing_allocations.cpp


def run_with(shop, at, how, old):
    """Exit code, messages, how many allocations there were and how many failed (no numbers where the program did not come to exit)."""
    shop.clear()
    shop.output.write_bytes(old)
    with tempfile.NamedTemporaryFile() as log:
        environment = {"LD_PRELOAD": str(shop.failing_allocations), "VELATURA_FAULT_PROGRAM": "velatura", "VELATURA_FAULT_AT": str(at), "VELATURA_FAULT_HOW": how, "VELATURA_FAULT_LOG": log.name}
        code, text = shop.run(1, environment=environment)
        counts = [int(n) for n in pathlib.Path(log.name).read_text().split()]
    return code, text, counts or None


def count_allocations(shop, old):
    code, text, counts = run_with(shop, 1 << 62, "alone", old)
    expect(code == 0 and counts, f"{shop.scene}: a render whose allocations are counted ends with {code}: {text}")
    return counts[0]


def spread(rng, total, count):
    """Numbers from 1 to the total: half of them anywhere, half by their logarithm, as much of what may go wrong is at the begin."""
    numbers = {1 + int(math.exp(rng.uniform(0, math.log(total)))) for _ in range(count // 2)}
    numbers |= {rng.randint(1, total) for _ in range(count - count // 2)}
    return sorted(n for n in numbers if n <= total)


def try_allocation(shop, old, at, how):
    """Returns the exit code."""
    what = f"{shop.scene}: memory {'refused once' if how == 'alone' else 'exhausted'} at allocation {at}"
    code, text, _ = run_with(shop, at, how, old)
    expect(code >= 0, f"{what}: ended by signal {-code}: {text}")
    expect(code in DOCUMENTED, f"{what}: exit code {code}: {text}")
    if code == 0:
        expect(shop.hash() == shop.expected, f"{what}: exit code 0 and another image")
    else:
        expect(text.strip(), f"{what}: exit code {code} and no word of why")
        expect(shop.output.exists() and shop.output.read_bytes() == old, f"{what}: exit code {code}, and the old file is gone")
    shop.expect_right_end(what)
    return code
