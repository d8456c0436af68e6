// SPDX-License-Identifier: Apache-2.0
#include "compose_fixture.h"

#include <algorithm>

namespace velatura::usd::compose {
namespace {

class ComposerTest : public ComposeFixture {
  protected:
    /// Prim stack of a stage composed anew, as options may have changed.
    Lines stack(const std::string& path) {
        reopen();
        const Lines lines = ComposeFixture::stack(path);
        children_ = children(path);
        return lines;
    }

    bool has_error(const std::string& code) const {
        const std::vector<Diagnostic> all = diagnostics_.all();
        return std::any_of(all.begin(), all.end(),
                           [&](const Diagnostic& d) { return d.code == code && d.loc.line > 0; });
    }

    Lines children_;
};

TEST_F(ComposerTest, StrengthOrderIsLIVRPS) {
    write("root.usda", R"(
def "I" {}
def "S" {}
def "P" ( specializes = </S>; payload = @pay.usda@</Pay>; references = @ref.usda@</Ref>;
inherits = </I>
          variants = { string v = "a" } variantSets = "v" )
{ variantSet "v" = { "a" { } } }
)");
    write("ref.usda", "def \"Ref\" {}\n");
    write("pay.usda", "def \"Pay\" {}\n");
    EXPECT_EQ(stack("/P"),
              (Lines{"root /P", "root /I", "root /P{v=a}", "ref /Ref", "pay /Pay", "root /S"}));
}

TEST_F(ComposerTest, SublayersAndSession) {
    write("root.usda", "( subLayers = [@a.usda@, @b.usda@] )\ndef \"P\" {}\n");
    write("a.usda", "over \"P\" {}\n");
    write("b.usda", "over \"P\" {}\n");
    write("s.usda", "over \"P\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "a /P", "b /P"}));
    session_.files = {(folder_ / "s.usda").string()};
    EXPECT_EQ(stack("/P"), (Lines{"s /P", "root /P", "a /P", "b /P"}));
    reopen();
    write("t.usda", "over \"P\" {}\n");
    session_.files.insert(session_.files.begin(), (folder_ / "t.usda").string());
    session_.made = std::make_shared<layer::Layer>("made.usda");
    session_.made->create_spec(layer::Path::from("/P"), layer::SpecKind::Prim, {});
    EXPECT_EQ(stack("/P"), (Lines{"made /P", "t /P", "s /P", "root /P", "a /P", "b /P"}));
}

TEST_F(ComposerTest, ImpliedClassesAreStrongerThanTheReferenceButWeakerThanAuthored) {
    // AOUSD 1.0.1, 10.4.2.4
    write("root.usda", R"(
class "RootClass" {}
class "RefClass" {}
def "Root" ( inherits = </RootClass>; references = @ref.usda@</Ref> ) {}
)");
    write("ref.usda", "class \"RefClass\" {}\ndef \"Ref\" ( inherits = </RefClass> ) {}\n");
    EXPECT_EQ(stack("/Root"), (Lines{"root /Root", "root /RootClass", "root /RefClass", "ref /Ref",
                                     "ref /RefClass"}));
}

TEST_F(ComposerTest, SpecializesIsGloballyWeakest) {
    // AOUSD 1.0.1, 10.4.2.6
    const char* classes = "class \"C1\" ( specializes = </C2> ) {}\nclass \"C2\" {}\n";
    write("root.usda",
          std::string(classes) + "def \"Root\" ( references = @ref.usda@</Ref> ) {}\n");
    write("ref.usda", std::string(classes) + "def \"Ref\" ( specializes = </C1> ) {}\n");
    EXPECT_EQ(stack("/Root"),
              (Lines{"root /Root", "ref /Ref", "root /C1", "ref /C1", "root /C2", "ref /C2"}));
}

TEST_F(ComposerTest, DeeperArcsAreStronger) {
    // AOUSD 1.0.1, 10.4.2.3
    write("root.usda", R"(
def "Root" ( references = @a.usda@</A> ) { def "Child" ( references = @b.usda@</B> ) {} }
)");
    write("a.usda", "def \"A\" { def \"Child\" {} }\n");
    write("b.usda", "def \"B\" {}\n");
    EXPECT_EQ(stack("/Root/Child"), (Lines{"root /Root/Child", "b /B", "a /A/Child"}));
}

TEST_F(ComposerTest, SubRootReferenceBringsAncestralOpinions) {
    write("root.usda", "def \"P\" ( references = @a.usda@</A/Child> ) {}\n");
    write("a.usda", "def \"A\" ( references = @b.usda@</B> ) { over \"Child\" {} }\n");
    write("b.usda", "def \"B\" { def \"Child\" { def \"Leaf\" {} } }\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "a /A/Child", "b /B/Child"}));
    EXPECT_EQ(children_, (Lines{"Leaf"}));
}

TEST_F(ComposerTest, VariantSelectionOfTheReferencerWins) {
    write("root.usda",
          "def \"P\" ( references = @a.usda@</A>; variants = { string v = \"y\" } ) {}\n");
    write("a.usda", R"(
def "A" ( variantSets = "v"; variants = { string v = "x" } )
{ variantSet "v" = { "x" { def "X" {} } "y" { def "Y" {} } } }
)");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "a /A", "a /A{v=y}"}));
    EXPECT_EQ(children_, (Lines{"Y"}));
}

TEST_F(ComposerTest, VariantFallbackCountsOnlyWithoutSelection) {
    write("root.usda", R"(
def "P" ( variantSets = "v" ) { variantSet "v" = { "x" { } "y" { } } }
def "Q" ( variantSets = "v";
variants = { string v = "x" } ) { variantSet "v" = { "x" { } "y" { } } }
)");
    EXPECT_EQ(stack("/P"), (Lines{"root /P"}));
    options_.variant_fallbacks["v"] = {"nope", "y"};
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "root /P{v=y}"}));
    EXPECT_EQ(stack("/Q"), (Lines{"root /Q", "root /Q{v=x}"}));
}

TEST_F(ComposerTest, PayloadsCanStayUnloaded) {
    write("root.usda", "def \"P\" ( payload = @a.usda@</A> ) {}\n");
    write("a.usda", "def \"A\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "a /A"}));
    options_.payloads = PayloadPolicy::LoadNone;
    EXPECT_EQ(stack("/P"), (Lines{"root /P"}));
}

TEST_F(ComposerTest, ListOpsComposeAcrossSublayers) {
    write("root.usda",
          "( subLayers = [@s.usda@] )\n"
          "def \"P\" ( delete references = @a.usda@</A>; append references = @b.usda@</B> ) {}\n");
    write("s.usda", "def \"P\" ( references = [@a.usda@</A>, @c.usda@</C>] ) {}\n");
    for (const char* name : {"a", "b", "c"}) {
        const std::string prim(1, char(std::toupper(name[0])));
        write(std::string(name) + ".usda", "def \"" + prim + "\" {}\n");
    }
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "s /P", "c /C", "b /B"}));
}

TEST_F(ComposerTest, CyclesAreErrorsAndTheRestLives) {
    write("root.usda", "def \"A\" ( references = </B> ) {}\ndef \"B\" ( references = </A> ) {}\n");
    EXPECT_EQ(stack("/A"), (Lines{"root /A", "root /B"}));
    EXPECT_TRUE(has_error("usd-arc-cycle"));
}

TEST_F(ComposerTest, SublayerCycleIsAnError) {
    write("root.usda", "( subLayers = [@a.usda@] )\ndef \"P\" {}\n");
    write("a.usda", "( subLayers = [@root.usda@] )\nover \"P\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P", "a /P"}));
    EXPECT_TRUE(has_error("usd-sublayer-cycle"));
}

TEST_F(ComposerTest, BrokenArcsAreErrorsWithAPlace) {
    write("root.usda",
          "def \"P\" ( references = [@none.usda@</A>, @a.usda@</None>, @a.usda@] ) {}\n");
    write("a.usda", "def \"A\" {}\n");
    EXPECT_EQ(stack("/P"), (Lines{"root /P"}));
    EXPECT_TRUE(has_error("usd-unresolved-asset"));
    EXPECT_TRUE(has_error("usd-unresolved-prim-path"));
    EXPECT_TRUE(has_error("usd-unresolved-default-prim"));
}

TEST_F(ComposerTest, BrokenCrateFilesAreNamed) {
    write("root.usda", "def \"P\" ( references = @c.usd@</A> ) {}\n");
    std::ofstream(folder_ / "c.usd") << "PXR-USDC and bytes";
    stack("/P");
    bool named = false;
    for (const Diagnostic& d : diagnostics_.all()) {
        named = named ||
                d.message.find("found 18 bytes, expected the 88 of a header") != std::string::npos;
    }
    EXPECT_TRUE(named);
}

TEST_F(ComposerTest, NodeLimitStopsAnExplosion) {
    // 2^12 paths through a ladder of diamonds
    std::string text;
    for (int i = 0; i < 12; ++i) {
        const std::string n = std::to_string(i), m = std::to_string(i + 1);
        text += "def \"A" + n + "\" ( references = [</B" + n + ">, </C" + n + ">] ) {}\n";
        text += "def \"B" + n + "\" ( references = </A" + m + "> ) {}\n";
        text += "def \"C" + n + "\" ( references = </A" + m + "> ) {}\n";
    }
    write("root.usda", text + "def \"A12\" {}\n");
    options_.max_nodes_per_prim = 500;
    EXPECT_LE(stack("/A0").size(), 500u);
    EXPECT_TRUE(has_error("usd-too-many-arcs"));
}

TEST_F(ComposerTest, ReorderNameChildren) {
    write("root.usda",
          "def \"P\" { reorder nameChildren = [\"c\", \"a\"]; def \"a\" {} def \"b\" {} def \"c\" "
          "{} }\n");
    stack("/P");
    EXPECT_EQ(children_, (Lines{"c", "a", "b"}));
}

}  // namespace
}  // namespace velatura::usd::compose
