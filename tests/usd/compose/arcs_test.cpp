// SPDX-License-Identifier: Apache-2.0
// Times along arcs, expressions, default prims, session owners, payloads, instances, targets and
// limits. Ref: AOUSD Core Specification 1.0.1, chapter 10.
#include "compose_fixture.h"
#include "property_stack.h"

#include <fmt/format.h>

namespace velatura::usd::compose {
namespace {

class ArcsTest : public ComposeFixture {
  protected:
    /// Time maps of the contributing nodes and their layers: "layer offset scale".
    Lines times(const std::string& path) {
        Lines lines;
        const PrimIndex found = index(path);
        for (const int i : found.contributing()) {
            const Node& n = found.nodes()[size_t(i)];
            for (const StackLayer& entry : n.stack->layers()) {
                if (!entry.layer->has_spec(n.path)) continue;
                const TimeOffset t = n.to_root->time_offset().after(entry.to_root);
                const std::filesystem::path file = entry.layer->identifier();
                lines.push_back(fmt::format("{} {} {}", file.stem().string(), t.offset, t.scale));
            }
        }
        return lines;
    }

    size_t count(ErrorKind kind) { return std::as_const(composer()).errors().count(kind); }

    /// Composes everything, as a stage does; returns the number of prims.
    size_t compose_all() {
        std::vector<PrimIndex> open = {composer().root_index()};
        size_t prims = 0;
        while (!open.empty()) {
            const PrimIndex at = std::move(open.back());
            open.pop_back();
            for (const layer::Token& name : composer().child_names(at, at.is_instanceable())) {
                open.push_back(composer().child_index(at, name, at.is_instanceable()));
                ++prims;
            }
        }
        return prims;
    }
};

TEST_F(ArcsTest, LayersWithOtherRatesAreRetimed) {
    write("root.usda", R"(( timeCodesPerSecond = 24
subLayers = [@sub.usda@ (offset = 10; scale = 2)] )
def "P" ( references = @ref.usda@</R> (offset = 5) ) {}
)");
    write("sub.usda", "( timeCodesPerSecond = 48 )\nover \"P\" {}\n");
    write("ref.usda", "( framesPerSecond = 12 )\ndef \"R\" {}\n");
    EXPECT_EQ(times("/P"), (Lines{"root 0 1", "sub 10 1", "ref 5 2"}));
}

TEST_F(ArcsTest, RatesThatAreNotPositiveAreReportedAnd24IsUsed) {
    for (const char* rate : {"0", "-24", "inf"}) {
        reopen();
        write("root.usda",
              "( timeCodesPerSecond = 48 )\ndef \"P\" ( references = @r.usda@</R> ) {}");
        write("r.usda", "( timeCodesPerSecond = " + std::string(rate) + " )\ndef \"R\" {}\n");
        EXPECT_EQ(times("/P"), (Lines{"root 0 1", "r 0 2"})) << rate;
    }
    EXPECT_EQ(diagnostics_.all().front().code, "usd-bad-time-rate");
}

TEST_F(ArcsTest, RatesOutOfBoundsAreNamedOnceWithWhatIsExpected) {
    for (const char* rate : {"1e-300", "1e300"}) {
        for (const char* name : {"timeCodesPerSecond", "framesPerSecond"}) {
            reopen();
            const size_t before = diagnostics_.all().size();
            write("root.usda", "( " + std::string(name) + " = " + rate + " )\ndef \"P\" {}");
            EXPECT_EQ(times("/P"), (Lines{"root 0 1"}));
            const auto all = diagnostics_.all();
            ASSERT_EQ(all.size(), before + 1) << rate;
            EXPECT_NE(all.back().message.find(std::string("found ") + name + " = "),
                      std::string::npos)
                << all.back().message;
            EXPECT_NE(all.back().message.find("expected a number from 1e-30 to 1e+30"),
                      std::string::npos)
                << all.back().message;
            EXPECT_EQ(all.back().loc.line, 2u);
        }
    }
}

TEST_F(ArcsTest, UnusableOffsetsAreErrorsAndLeftOut) {
    write("root.usda", R"(( subLayers = [@sub.usda@ (offset = 3; scale = 0)] )
def "P" ( references = @r.usda@</R> (offset = 1; scale = -1) ) {}
)");
    write("sub.usda", "over \"P\" {}\n");
    write("r.usda", "def \"R\" {}\n");
    EXPECT_EQ(times("/P"), (Lines{"root 0 1", "sub 0 1", "r 0 1"}));
    EXPECT_EQ(errors(), (Lines{"invalid-sublayer-offset", "invalid-reference-offset"}));
}

TEST_F(ArcsTest, ExpressionsChooseLayersReferencesAndVariants) {
    write("root.usda",
          R"(( expressionVariables = { string SUB = "sub"; string ASSET = "b"; string V = "x" }
subLayers = [@`"${SUB}.usda"`@, @`if(defined("NONE"), "none.usda", "")`@] )
def "P" ( references = @`"${ASSET}.usda"`@</R>; variantSets = "v";
variants = { string v = "`${V}`" } )
{ variantSet "v" = { "x" {} "y" {} } }
)");
    write("sub.usda", "over \"P\" {}\n");
    write("b.usda", "def \"R\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "sub /P", "root /P{v=x}", "b /R"}));
    EXPECT_TRUE(errors().empty());
}

TEST_F(ArcsTest, VariablesOfTheReferrerAreStronger) {
    write("root.usda", R"(( expressionVariables = { string W = "one" } )
def "P" ( references = @mid.usda@</M> ) {}
def "Q" ( references = @other.usda@</M> ) {}
)");
    const std::string mid = "def \"M\" ( references = @`\"${W}_${X}.usda\"`@</R> ) {}\n";
    write("mid.usda", "( expressionVariables = { string W = \"two\"; string X = \"a\" } )\n" + mid);
    write("other.usda", "( expressionVariables = { string X = \"b\" } )\n" + mid);
    write("one_a.usda", "def \"R\" {}\n");
    write("one_b.usda", "def \"R\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "mid /M", "one_a /R"}));
    EXPECT_EQ(stack("/Q"), (Lines{"root /Q", "other /M", "one_b /R"}));
}

TEST_F(ArcsTest, ExpressionsWithoutAStringAreErrors) {
    write("root.usda", R"(
def "P" ( references = [@`${MISSING}`@</R>, @`1`@</R>, @r.usda@</R>]
          variantSets = "v"; variants = { string v = "`${MISSING}`" } )
{ variantSet "v" = { "x" {} } }
)");
    write("r.usda", "def \"R\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "r /R"}));
    EXPECT_GE(count(ErrorKind::VariableExpression), 3u);
}

TEST_F(ArcsTest, DefaultPrimsMayBePaths) {
    write("root.usda", "def \"P\" ( references = @r.usda@ ) {}\n");
    write("r.usda", "( defaultPrim = \"/World/Asset\" )\ndef \"World\" { def \"Asset\" {} }\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "r /World/Asset"}));
}

TEST_F(ArcsTest, TheSessionsOwnerComesFirst) {
    session_.files = {(folder_ / "session.usda").string()};
    write("session.usda", "( sessionOwner = \"me\" )\n");
    write("root.usda", "( hasOwnedSubLayers = true\nsubLayers = [@a.usda@, @b.usda@] )\n");
    write("a.usda", "( owner = \"you\" )\ndef \"P\" {}\n");
    write("b.usda", "( owner = \"me\" )\ndef \"P\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"b /P", "a /P"}));
    reopen();
    write("a.usda", "( owner = \"me\" )\ndef \"P\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"a /P", "b /P"}));
    EXPECT_EQ(errors(), (Lines{"invalid-sublayer-ownership"}));
}

TEST_F(ArcsTest, PayloadsAreChosenByPrim) {
    write("root.usda", R"(
def "A" ( payload = @p.usda@</Pay> ) {}
def "B" ( payload = @p.usda@</Pay> ) {}
def "Sub" ( references = @q.usda@</Q/In> ) {}
)");
    write("p.usda", "def \"Pay\" {}\n");
    // To be there at all, what an arc leads to needs the payloads of its ancestors
    write("q.usda", "def \"Q\" ( payload = @r.usda@</R> ) {}\n");
    write("r.usda", "def \"R\" { def \"In\" {} }\n");
    options_.load_payloads = [](layer::Path p) { return p.to_string() == "/B"; };
    EXPECT_EQ(stack("/A"), (Lines{"root /A"}));
    EXPECT_TRUE(index("/A").has_payloads());
    EXPECT_FALSE(index("/A").payloads_included());
    EXPECT_EQ(stack("/B"), (Lines{"root /B", "p /Pay"}));
    EXPECT_EQ(stack("/Sub"), (Lines{"root /Sub", "r /R/In"}));
}

TEST_F(ArcsTest, InstancesShareWhatTheirArcsBring) {
    write("root.usda", R"(
def "A" ( instanceable = true; references = @r.usda@</R> ) { over "In" {} }
def "B" ( instanceable = true; references = @r.usda@</R> ) {}
def "Other" ( instanceable = true; references = @r.usda@</R> (offset = 1) ) {}
def "Variant" ( instanceable = true; references = @r.usda@</R>; variants = { string v = "y" } ) {}
def "Local" ( instanceable = true ) { def "In" {} }
)");
    write("r.usda", R"(
def "R" ( variantSets = "v"; variants = { string v = "x" } )
{ def "In" {} variantSet "v" = { "x" {} "y" {} } }
)");
    const std::string key = index("/A").instance_key();
    EXPECT_TRUE(index("/A").is_instanceable());
    EXPECT_EQ(index("/B").instance_key(), key);
    EXPECT_NE(index("/Other").instance_key(), key);
    EXPECT_NE(index("/Variant").instance_key(), key);
    EXPECT_FALSE(index("/Local").is_instanceable());
    // Local opinions below an instance do not count
    EXPECT_EQ(stack("/A/In"), (Lines{"r /R/In"}));
    EXPECT_EQ(stack("/Local/In"), (Lines{"root /Local/In"}));
}

TEST_F(ArcsTest, SelectionsOfWeakerArcsCount) {
    write("root.usda", R"(
def "P" ( references = @r.usda@</R>; variantSets = "v" )
{ variantSet "v" = { "x" ( references = @in.usda@</In> ) {} } }
)");
    write("r.usda", "def \"R\" ( variants = { string v = \"x\" } ) {}\n");
    write("in.usda", "def \"In\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "root /P{v=x}", "in /In", "r /R"}));
}

TEST_F(ArcsTest, VariantsOfSpecializedClassesCount) {
    write("root.usda", R"(
class "A" ( variantSets = "v"; variants = { string v = "x" } ) { variantSet "v" = { "x" {} } }
def "B" ( variantSets = "w"; variants = { string w = "y" } )
{ variantSet "w" = { "y" ( specializes = </A> ) {} } }
)");
    EXPECT_EQ(stack("/B"), (Lines{"root /B", "root /B{w=y}", "root /A", "root /A{v=x}"}));
}

TEST_F(ArcsTest, TargetsOutsideOfTheirArcAreErrors) {
    write("root.usda", R"(
def "P" ( references = @r.usda@</R> ) { delete rel gone = </P/Out> }
)");
    write("r.usda", R"(
def "R" { rel in = [</R/A>, </Elsewhere>]; rel gone = [</R/A>, </R/Out>] }
)");
    const PrimIndex found = index("/P");
    const ComposedTargets in = targets_of(found, "in");
    ASSERT_EQ(in.paths.size(), 1u);
    EXPECT_EQ(in.paths[0].to_string(), "/P/A");
    ASSERT_EQ(in.errors.size(), 1u);
    EXPECT_EQ(in.errors[0].kind, ErrorKind::InvalidExternalTargetPath);
    EXPECT_EQ(in.errors[0].site.to_string(), "/R.in");
    const ComposedTargets gone = targets_of(found, "gone");
    EXPECT_EQ(gone.paths.size(), 1u);
    ASSERT_EQ(gone.deleted.size(), 1u);
    EXPECT_EQ(gone.deleted[0].to_string(), "/P/Out");
}

TEST_F(ArcsTest, StrongerExplicitTargetsForgiveWeakerErrors) {
    write("root.usda", "def \"P\" ( references = @r.usda@</R> ) { rel r = </P/B> }\n");
    write("r.usda", "def \"R\" { rel r = </Elsewhere> }\n");
    const ComposedTargets targets = targets_of(index("/P"), "r");
    EXPECT_TRUE(targets.errors.empty());
    EXPECT_EQ(targets.paths.size(), 1u);
}

TEST_F(ArcsTest, AttributesAndRelationshipsDoNotMix) {
    write("root.usda", "def \"P\" ( references = @r.usda@</R> ) { rel x }\n");
    write("r.usda", "def \"R\" { double x = 1 }\n");
    std::vector<CompositionError> found;
    EXPECT_EQ(property_stack(index("/P"), layer::Token("x"), &found).size(), 1u);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].kind, ErrorKind::InconsistentPropertyType);
}

TEST_F(ArcsTest, ErrorsKnowTheirSite) {
    write("root.usda", "def \"P\" ( references = @r.usda@</R> ) {}\n");
    write("r.usda", "def \"R\" ( references = @none.usda@</N> ) {}\n");
    index("/P");
    const std::vector<CompositionError> all = std::as_const(composer()).errors().all();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].kind, ErrorKind::InvalidAssetPath);
    EXPECT_EQ(all[0].prim.to_string(), "/P");
    EXPECT_EQ(all[0].site.to_string(), "/R");
    EXPECT_TRUE(all[0].layer_stack.ends_with("r.usda"));
    EXPECT_EQ(all[0].loc.line, 2u);
}

TEST_F(ArcsTest, ASmallFileCannotAskForAHugeStage) {
    // 10^9 prims
    for (const char* instanceable : {"", "instanceable = true\n"}) {
        reopen();
        std::string text = "def \"L9\" {}\n";
        for (int level = 0; level < 9; ++level) {
            text += fmt::format("def \"L{}\" {{", level);
            for (int c = 0; c < 10; ++c)
                text += fmt::format("def \"c{}\" ( {}references = </L{}> ) {{}}\n", c, instanceable,
                                    level + 1);
            text += "}\n";
        }
        write("root.usda", text);
        options_.min_node_limit = 20'000;
        options_.max_nodes_per_spec = 10;
        EXPECT_LT(compose_all(), 20'000u);
        EXPECT_EQ(count(ErrorKind::CapacityExceeded), 1u);
    }
}

TEST_F(ArcsTest, TheLimitOfPrimsIsReportedOnce) {
    write("root.usda", "def \"A\" { def \"x\" {} def \"y\" {} }\ndef \"B\" { def \"z\" {} }\n");
    options_.max_prims = 3;
    EXPECT_EQ(compose_all(), 3u);
    EXPECT_EQ(errors(), (Lines{"capacity-exceeded"}));
}

TEST_F(ArcsTest, ArcsIntoOneAnotherComeToAnEnd) {
    std::string text;
    for (int i = 0; i < 40; ++i) {
        const int n = i + 1;
        text += fmt::format(
            "def \"P{0}\" ( references = [</P{1}>, </P{1}/x>] ) {{\n"
            "def \"x\" ( references = </P{1}/x> ) {{}}\n"
            "def \"y\" ( references = </P{1}/x> ) {{}}\n}}\n",
            i, n);
    }
    write("root.usda", text + "def \"P40\" { def \"x\" {} }\n");
    options_.min_node_limit = 20'000;
    options_.max_nodes_per_spec = 10;
    compose_all();
    EXPECT_EQ(count(ErrorKind::CapacityExceeded), 1u);
}

TEST_F(ArcsTest, OffsetsOfNanAreReportedAndTheRestGoesOn) {
    write("b.usda", "def \"B\" { def \"x\" {} }\n");
    for (const char* arc : {"payload", "references"}) {
        for (const char* offset : {"offset = nan", "scale = nan", "scale = inf; offset = nan"}) {
            write("root.usda", fmt::format("def \"A\" ( {} = @b.usda@</B> ({}) ) {{}}\n"
                                           "def \"C\" ( references = @b.usda@</B> ) {{}}\n",
                                           arc, offset));
            reopen();
            EXPECT_EQ(index("/C/x").contributing().size(), 1u);
            index("/A");
            EXPECT_EQ(errors().size(), 1u) << arc << " " << offset;
        }
    }
}

}  // namespace
}  // namespace velatura::usd::compose
