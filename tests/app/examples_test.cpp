// SPDX-License-Identifier: Apache-2.0
#include "command.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::test {

// The second image is another view in other light, and both are whole files of light layers.
TEST(Examples, RelightRendersTwice) {
    const Workplace w;
    const CommandResult r =
        w.run("velatura_example_relight", std::string(VELATURA_SOURCE_DIR) +
                                              "/scenes/cornell/cornell.usda first.exr second.exr");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    EXPECT_NE(r.output.find("second.exr: ready after "), std::string::npos) << r.output;
    for (const char* file : {"first.exr", "second.exr"})
        EXPECT_EQ(w.comp(std::string("verify ") + file).exit_code, 0) << file;
    EXPECT_NE(w.hash("first.exr"), w.hash("second.exr"));
}

}  // namespace velatura::test
