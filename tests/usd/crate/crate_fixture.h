// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/reader.h"
#include "usd/crate/writer.h"
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace velatura::usd::crate {

using LayerPtr = std::shared_ptr<layer::Layer>;

/// A layer of text, which must be good.
inline LayerPtr layer_of(const std::string& text) {
    Diagnostics diagnostics;
    auto result = text::read_text_layer(text, "test.usda", diagnostics);
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    return result ? *result : nullptr;
}

inline std::string crate_of(const layer::Layer& layer, CrateWriteOptions options = {}) {
    Diagnostics diagnostics;
    auto result = write_crate_layer(layer, diagnostics, options);
    for (const Diagnostic& d : diagnostics.all()) ADD_FAILURE() << diagnostics.format(d);
    return result ? *result : std::string();
}

inline std::string print(const layer::Layer& layer) {
    return text::write_text_layer(layer);
}

/// Every type of value and kind of field that crates hold and text prints.
inline const char* const every_kind = R"x(#usda 1.0
(
    "a comment"
    customLayerData = {
        bool b = 1
        dictionary d = {
            int[] empty = []
            string s = "text"
            dictionary nothing = {
            }
        }
        double[] numbers = [1, 0.1]
        string unknown = "kept"
    }
    defaultPrim = "A"
    doc = """two
lines"""
    endTimeCode = 24
    expressionVariables = {
        string X = "x"
    }
    relocates = {
        </A/Old>: </A/New>,
        </A/Gone>: <>
    }
    subLayers = [
        @a.usda@,
        @b.usda@ (offset = 1; scale = 2)
    ]
    unheardOf = [1, 2, "x"]
)

reorder rootPrims = ["B", "A"]

def Xform "A" (
    prepend apiSchemas = ["S", "T:x"]
    assetInfo = {
        asset identifier = @a/b@
    }
    append clipSets = ["c"]
    add inactiveIds = [1, -9223372036854775808]
    delete inherits = </C>
    instanceable = true
    kind = "component"
    payload = [
        @p.usda@</P>,
        @q.usda@ (offset = 3)
    ]
    permission = private
    prepend references = [
        @r.usda@</R> (
            offset = 1
            scale = 0.5
            customData = {
                int note = 3
            }
        ),
        </B>
    ]
    reorder specializes = [
        </C>,
        </B>
    ]
    variants = {
        string v = "x"
    }
    append variantSets = ["v", "w"]
)
{
    reorder nameChildren = ["Second", "First"]
    reorder properties = ["b", "a"]
    asset asset = @one@
    asset[] assets = [@one@, @two@]
    bool bit = 1
    bool[] bits = [0, 1, 1]
    color3f[] colors = [(0.1, 0.2, 0.3), (1, 0, 0)]
    int[] counts = [4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 3]
    double d = 0.1
    double d0 = -0
    double dbig = 1e300
    double dinf = inf
    double[] dlut = [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1, 0.2]
    double2 d2 = (1, -2)
    double3 d3 = (1.5, -2, 3)
    double4 d4 = (1, -2, 3, 128)
    float f = 0.1
    float[] fints = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, -16]
    float[] fzero = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, -0]
    float2 f2 = (1, 2)
    float2[] f2s = [(1, 2), (3, 4.5)]
    float3 f3 = (-0, 0, 1)
    float4 f4 = (1, 2, 3, 4)
    half h = 0.5
    half[] hs = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]
    half2 h2 = (0.5, 2)
    half3 h3 = (1, 2, 3)
    half4 h4 = (1, 2.5, 3, 4)
    int i = -7
    int2 i2 = (1, 300)
    int3 i3 = (1, 2, 3)
    int4 i4 = (1, 2, 3, 4)
    int64 i64 = -9223372036854775808
    int64[] i64s = [0, 1, 9223372036854775807, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 70000]
    matrix2d m2 = ( (1, 2), (3, 4) )
    matrix3d m3 = ( (1, 0, 0), (0, 2, 0), (0, 0, 3) )
    matrix4d m4 = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )
    matrix4d[] m4s = [( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )]
    float none = None
    pathExpression pe = "/A//"
    pathExpression[] pes = ["/A//", "//B"]
    quatd qd = (1, 2, 3, 4)
    quatf qf = (1, 2, 3, 4)
    quatf[] qfs = [(1, 2, 3, 4), (0.5, 0, 0, 0)]
    quath qh = (1, 2, 3, 4)
    custom rel rel = [
        </A.d>,
        </B>,
    ]
    prepend rel rel2 = </B.y[/A].z>
    string s = "text"
    string[] ss = ["", "text", "text"]
    double spline
    double spline.spline = {
        bezier,
        pre: sloped(0.5),
        post: loop oscillate,
        loop: (1, 2, 0, 3, 4),
        1: 1 & 2; pre (0, 0); post curve (1.25, 0.125),
        6: 20; pre (1.5, -0.5); post linear; {
            string note = "n"
        },
    }
    timecode t = 1.1
    timecode[] ts = [1, 2]
    uniform token tok = "t"
    token[] toks = ["t", "", "u"]
    double x.timeSamples = {
        -1: None,
        0: 0.5,
        1e7: 3,
    }
    double x.connect = </B.out>
    uchar u = 255
    uchar[] us = [0, 255]
    uint ui = 4294967295
    uint[] uis = [0, 4294967295, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]
    uint64 u64 = 18446744073709551615
    uint64[] u64s = [18446744073709551615]
    varying rel vary = </B>
    point3f[] w.timeSamples = {
        1: [(1, 2, 3)],
        2: [],
    }

    over "First"
    {
    }

    class "Second" (
        active = false
    )
    {
    }

    variantSet "v" = {
        "x" (
            kind = "k"
        ) {
            int i = 1

            def "InVariant"
            {
            }

            variantSet "inner" = {
                "-1" {

                }
            }

        }
        "y" {

        }
    }
}

class "B"
{
    double out
}

)x";

}  // namespace velatura::usd::crate
