// SPDX-License-Identifier: Apache-2.0
#include "base/markup.h"

#include <gtest/gtest.h>

namespace velatura::test {

TEST(Markup, EscapesWhatTagsAndAttributesCannotHold) {
    EXPECT_EQ(escape_markup("plain é text"), "plain é text");
    EXPECT_EQ(escape_markup("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    EXPECT_EQ(escape_markup("&amp;"), "&amp;amp;");
    // XML 1.0, section 2.2: of the control characters only tab and line ends
    EXPECT_EQ(escape_markup("tab\tline\nbell\x07"), "tab\tline\nbell ");
}

}  // namespace velatura::test
