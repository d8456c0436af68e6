// SPDX-License-Identifier: Apache-2.0
#include "usd/text/writer.h"

#include "usd/text/reader.h"

#include <gtest/gtest.h>

#include <string>

namespace velatura::usd::text {
namespace {

// Already in the writer's own layout
constexpr const char* every_feature = R"x(#usda 1.0
(
    "a comment"
    customLayerData = {
        int a = 1
        dictionary b = {
            double3[] c = [(1, 2, 3)]
        }
        int "two words" = 2
    }
    defaultPrim = "A"
    doc = """two
lines"""
    relocates = {
        </A/B>: </A/C>,
        </A/D>: <>
    }
    subLayers = [
        @a.usda@,
        @b.usda@ (offset = 2; scale = 0.5)
    ]
    unheardOf = [1, "x"]
    prepend unheardOfEdit = [5.67, a]
)

reorder rootPrims = ["A", "B"]

def Xform "A" (
    active = false
    prepend apiSchemas = ["P", "Q"]
    inherits = </B>
    kind = "component"
    payload = None
    permission = private
    delete references = @x.usda@
    prepend references = [
        @y.usda@</Y>,
        </Z> (offset = 1)
    ]
    symmetryFunction = mirror
    variants = {
        string v = "x"
    }
    prepend variantSets = "v"
)
{
    reorder nameChildren = ["b", "a"]
    custom uniform token a = "t" (
        hidden = true
    )
    uniform token a.connect = </B.out>
    asset b = @a@
    float c = None
    float c.timeSamples = {
        -1: None,
        2.5: 1e-7,
    }
    matrix2d d = ( (1, 2), (3, 4) )
    quatf e = (1, 2, 3, 4)
    rel f = [
        </B>,
        </C.x>,
    ]
    prepend rel g = </B>
    double h.spline = {
        bezier,
        pre: sloped(0.5),
        loop: (1, 2, 0, 3, 4),
        1: 1 & 2; pre (0, 0); post curve (1.25, 0.125),
        6: 20; pre (1.5, -0.5); post linear,
    }

    over "Child"
    {
    }

    variantSet "v" = {
        "x" (
            kind = "k"
        ) {
            int i = 1

        }
    }
}

class "B"
{
}

)x";

TEST(Writer, WritesItsOwnLayoutBack) {
    Diagnostics diagnostics;
    const auto layer = read_text_layer(every_feature, "a.usda", diagnostics);
    ASSERT_TRUE(layer) << diagnostics.format(diagnostics.all()[0]);
    EXPECT_EQ(write_text_layer(**layer), every_feature);
}

TEST(Writer, SortsNamesByLettersAndNumbers) {
    EXPECT_TRUE(dictionary_less("a2", "a10"));
    EXPECT_TRUE(dictionary_less("abc", "Abd"));
    EXPECT_TRUE(dictionary_less("B", "c"));
    EXPECT_TRUE(dictionary_less("A", "a"));
    EXPECT_FALSE(dictionary_less("a", "a"));
    EXPECT_TRUE(dictionary_less("a", "a1"));
}

}  // namespace
}  // namespace velatura::usd::text
