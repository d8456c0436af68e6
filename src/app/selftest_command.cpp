// SPDX-License-Identifier: Apache-2.0
#include "app/commands.h"
#include "app/exit_codes.h"
#include "selftest/checks.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <memory>

namespace velatura::app {

namespace {

/// "0 (must be 0)", "3.1e-06 (at most 1e-05)".
std::string measured_text(const selftest::Finding& finding) {
    if (finding.bound == 0) return fmt::format("{:g}, must be 0", finding.measured);
    return fmt::format("{:.2g}, at most {:.2g}", finding.measured, finding.bound);
}

int run_checks(uint64_t amount, bool as_json) {
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    size_t failed = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (const selftest::Check& check : selftest::checks()) {
        const selftest::Finding finding = check.run(amount);
        failed += finding.passes() ? 0 : 1;
        if (as_json) {
            report.push_back({{"case", check.hard_case},
                              {"question", check.question},
                              {"oracle", check.oracle},
                              {"measured_what", finding.what},
                              {"measured", finding.measured},
                              {"bound", finding.bound},
                              {"detectable", finding.detectable},
                              {"passed", finding.passes()}});
            continue;
        }
        fmt::print("{}  {}\n        {}: {} (oracle: {})\n", finding.passes() ? "passed" : "FAILED",
                   check.question, finding.what, measured_text(finding), check.oracle);
    }
    if (as_json) {
        fmt::print("{}\n", report.dump(2));
    } else {
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        fmt::print("\n{} of {} checks passed in {:.1f} s.{}\n", selftest::checks().size() - failed,
                   selftest::checks().size(), seconds,
                   failed == 0 ? "" : " Do not trust renders of this program on this machine.");
    }
    return failed == 0 ? Done : CheckFailed;
}

}  // namespace

void add_selftest_command(Command& app, std::function<int()>& run) {
    Command command =
        app.add_subcommand("selftest",
                           "Check this machine against known answers: intersection, energy, sums, "
                           "bit-identity; exit code 4 if a check fails");
    auto amount = std::make_shared<uint64_t>(1);
    auto as_json = std::make_shared<bool>(false);
    command.add_option("--amount", *amount, "Factor on the number of samples").range(1, 1000000);
    command.add_flag("--json", *as_json, "Print JSON");
    command.example("velatura selftest --amount 100");
    command.callback([amount, as_json, &run] {
        run = [amount, as_json] { return run_checks(*amount, *as_json); };
    });
}

}  // namespace velatura::app
