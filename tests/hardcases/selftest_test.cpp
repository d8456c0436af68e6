// SPDX-License-Identifier: Apache-2.0
// What a shipped program checks of itself, as tests of the hard cases: every check at every size.
#include "hard_case.h"
#include "selftest/checks.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::selftest {
namespace {

/// A test for each check, in a suite of its case.
class CheckTest : public testing::Test {
  public:
    explicit CheckTest(const Check& check) : check_(check) {}

    void TestBody() override {
        const Finding finding = check_.run(hardcase::sized(1, 100, 1000));
        hardcase::expect_within(
            {finding.what, finding.measured, finding.bound, finding.detectable, check_.oracle});
    }

  private:
    const Check& check_;
};

const bool are_registered = [] {
    for (const Check& check : checks()) {
        const std::string suite = std::string(check.hard_case) + "Selftest";
        testing::RegisterTest(suite.c_str(), "AnswerIsKnown", nullptr, nullptr, __FILE__, __LINE__,
                              [&check]() -> testing::Test* { return new CheckTest(check); });
    }
    return !checks().empty();
}();

TEST(Selftest, HasNoCaseTwice) {
    ASSERT_TRUE(are_registered);
    std::string last;
    for (const Check& check : checks()) {
        EXPECT_LT(last, check.hard_case);
        last = check.hard_case;
    }
}

// A check that cannot fail is none: a number that is none, and noise that hides the bound, do not
// pass
TEST(Selftest, FindingsPassByTheirBounds) {
    EXPECT_TRUE((Finding{"", 0, 0}.passes()));
    EXPECT_TRUE((Finding{"", 0.5, 1, 0.9}.passes()));
    EXPECT_FALSE((Finding{"", 1.5, 1}.passes()));
    EXPECT_FALSE((Finding{"", 0.5, 1, 1.1}.passes()));
    EXPECT_FALSE((Finding{"", std::nan(""), 1}.passes()));
}

}  // namespace
}  // namespace velatura::selftest
