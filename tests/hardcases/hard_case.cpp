// SPDX-License-Identifier: Apache-2.0
#include "hard_case.h"

#include "base/check.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace velatura::hardcase {

namespace {

std::string_view size_name() {
    const char* name = std::getenv("VELATURA_HARDCASES_SIZE");
    return name ? name : "commit";
}

/// "H07" for a suite "H07HugeThinSlab" or "Radii/H07HugeThinSlab"; empty for any other.
std::string case_of(std::string_view suite) {
    if (const size_t slash = suite.rfind('/'); slash != std::string_view::npos)
        suite.remove_prefix(slash + 1);
    const auto is_digit = [&](size_t i) {
        return std::isdigit(static_cast<unsigned char>(suite[i])) != 0;
    };
    if (suite.size() < 3 || suite[0] != 'H' || !is_digit(1) || !is_digit(2)) return {};
    return std::string(suite.substr(0, 3));
}

bool is_kept(const Measurement& m) {
    return m.measured <= m.bound && m.detectable <= m.bound;
}

/// JSON knows no number that is none.
nlohmann::json number(double x) {
    return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(nullptr);
}

const testing::TestInfo& running_test() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    VELATURA_CHECK(test, "a measurement outside of tests");
    return *test;
}

void record(const Measurement& m, bool is_known_failure) {
    const char* path = std::getenv("VELATURA_HARDCASES_RECORD");
    const testing::TestInfo& test = running_test();
    const std::string name = case_of(test.test_suite_name());
    if (!path || name.empty()) return;
    const std::string line =
        nlohmann::json{{"case", name},
                       {"test", std::string(test.test_suite_name()) + "." + test.name()},
                       {"what", m.what},
                       {"measured", number(m.measured)},
                       {"bound", m.bound},
                       {"detectable", number(m.detectable)},
                       {"oracle", m.oracle},
                       {"sees", m.sees},
                       {"size", size_name()},
                       {"kept", is_kept(m)},
                       {"known", is_known_failure}}
            .dump() +
        "\n";
    // Programs that run side by side append to one file: a line is one write
    const int file = ::open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
    VELATURA_CHECK(file >= 0, "cannot open the file of VELATURA_HARDCASES_RECORD");
    const ssize_t written = ::write(file, line.data(), line.size());
    ::close(file);
    VELATURA_CHECK(written == ssize_t(line.size()),
                   "cannot write the file of VELATURA_HARDCASES_RECORD");
}

}  // namespace

Size size() {
    const std::string_view name = size_name();
    if (name == "nightly") return Size::Nightly;
    if (name == "release") return Size::Release;
    VELATURA_CHECK(name == "commit", "VELATURA_HARDCASES_SIZE is none of commit, nightly, release");
    return Size::Commit;
}

uint64_t sized(uint64_t commit, uint64_t nightly, uint64_t release) {
    switch (size()) {
        case Size::Nightly:
            return nightly;
        case Size::Release:
            return release;
        case Size::Commit:
            break;
    }
    return commit;
}

void expect_within(const Measurement& m) {
    record(m, false);
    EXPECT_LE(m.measured, m.bound) << m.what;
    EXPECT_LE(m.detectable, m.bound)
        << m.what << ": the test could not see its bound; more samples are needed";
}

void expect_known_failure(const Measurement& m) {
    record(m, true);
    EXPECT_FALSE(is_kept(m)) << m.what << ": the bound is kept now; let the test expect it";
}

void expect_in_hard_case(const Measurement& m) {
    if (!case_of(running_test().test_suite_name()).empty()) expect_within(m);
}

}  // namespace velatura::hardcase
