// SPDX-License-Identifier: Apache-2.0
// Relocates: AOUSD Core Specification 1.0.1, 10.3.2 and 10.4.
#include "compose_fixture.h"
#include "property_stack.h"

namespace velatura::usd::compose {
namespace {

class RelocatesTest : public ComposeFixture {
  protected:
    /// A rig with a deep Anim scope, referenced by /Char of the root layer.
    void write_char(const std::string& relocates, const std::string& body = "") {
        write("root.usda", "( relocates = { " + relocates + " } )\n" +
                               "def \"Char\" ( references = @rig.usda@</Base> ) {" + body + "}\n");
        write("rig.usda", R"(
def "Base" {
    def "Rig" {
        rel where = </Base/Rig/Anim>
        def "Anim" { def "Leaf" { custom double x.connect = </Base/Rig/Anim.out> } }
        def "Other" {}
    }
    def "Last" {}
}
)");
    }

    Lines targets(const std::string& prim, const char* property) {
        Lines result;
        const PrimIndex found = index(prim);
        for (const layer::Path& p : targets_of(found, property).paths)
            result.push_back(p.to_string());
        return result;
    }
};

TEST_F(RelocatesTest, MoveAPrimOfAReference) {
    write_char("</Char/Rig/Anim>: </Char/Anim>", "over \"Anim\" { over \"Leaf\" {} }");
    EXPECT_EQ(stack("/Char/Anim"), (Lines{"root /Char/Anim", "rig /Base/Rig/Anim"}));
    EXPECT_EQ(stack("/Char/Anim/Leaf"), (Lines{"root /Char/Anim/Leaf", "rig /Base/Rig/Anim/Leaf"}));
    EXPECT_EQ(children("/Char"), (Lines{"Rig", "Last", "Anim"}));
    EXPECT_EQ(children("/Char/Rig"), (Lines{"Other"}));
    EXPECT_EQ(prohibited("/Char/Rig"), (Lines{"Anim"}));
    EXPECT_TRUE(stack("/Char/Rig/Anim").empty());
    EXPECT_TRUE(errors().empty());
}

TEST_F(RelocatesTest, TargetsFollow) {
    write_char("</Char/Rig/Anim>: </Char/Anim>");
    EXPECT_EQ(targets("/Char/Rig", "where"), (Lines{"/Char/Anim"}));
    EXPECT_EQ(targets("/Char/Anim/Leaf", "x"), (Lines{"/Char/Anim.out"}));
}

TEST_F(RelocatesTest, RenamedChildrenKeepTheirPlace) {
    write_char("</Char/Rig>: </Char/Bones>");
    EXPECT_EQ(children("/Char"), (Lines{"Bones", "Last"}));
    EXPECT_EQ(prohibited("/Char"), (Lines{"Rig"}));
    EXPECT_EQ(stack("/Char/Bones/Anim"), (Lines{"rig /Base/Rig/Anim"}));
}

TEST_F(RelocatesTest, ArrivingChildrenStandInOrderOfTheirNames) {
    write_char("</Char/Rig/Anim>: </Char/Z>, </Char/Rig/Other>: </Char/A>");
    EXPECT_EQ(children("/Char"), (Lines{"Rig", "Last", "A", "Z"}));
}

TEST_F(RelocatesTest, EmptyTargetDeletes) {
    write_char("</Char/Rig>: <>");
    EXPECT_EQ(children("/Char"), (Lines{"Last"}));
    EXPECT_EQ(prohibited("/Char"), (Lines{"Rig"}));
    EXPECT_TRUE(stack("/Char/Rig").empty());
}

TEST_F(RelocatesTest, ChainsNameTheSourceAsItIsByThen) {
    write_char("</Char/Rig>: </Char/Bones>, </Char/Bones/Anim>: </Char/Anim>");
    EXPECT_EQ(children("/Char"), (Lines{"Bones", "Last", "Anim"}));
    EXPECT_EQ(stack("/Char/Anim"), (Lines{"rig /Base/Rig/Anim"}));
    EXPECT_EQ(targets("/Char/Bones", "where"), (Lines{"/Char/Anim"}));
}

TEST_F(RelocatesTest, ARootPrimMayBeTheTarget) {
    write_char("</Char/Rig/Anim>: </Anim>");
    EXPECT_EQ(stack("/Anim"), (Lines{"rig /Base/Rig/Anim"}));
    // What relocations bring is weaker than the names the layers say themselves
    EXPECT_EQ(children("/"), (Lines{"Anim", "Char"}));
}

TEST_F(RelocatesTest, RelocationsOfAReferencedStackGoAlong) {
    write_char("</Char/Rig/Anim>: </Char/Anim>");
    std::filesystem::rename(folder_ / "root.usda", folder_ / "char.usda");
    write("root.usda", "def \"Hero\" ( references = @char.usda@</Char> ) { over \"Anim\" {} }\n");
    EXPECT_EQ(stack("/Hero/Anim"), (Lines{"root /Hero/Anim", "rig /Base/Rig/Anim"}));
    EXPECT_EQ(prohibited("/Hero/Rig"), (Lines{"Anim"}));
    EXPECT_EQ(targets("/Hero/Rig", "where"), (Lines{"/Hero/Anim"}));
}

TEST_F(RelocatesTest, ClassesImpliedFromTheOldPlaceReachTheNewOne) {
    write("root.usda", R"(( relocates = { </Char/Rig/Arm>: </Char/Arm> } )
def "Char" ( references = @rig.usda@</Base> ) { over "Rig" { over "ArmClass" {} } }
)");
    write("rig.usda", R"(
def "Base" { def "Rig" { class "ArmClass" {} def "Arm" ( inherits = </Base/Rig/ArmClass> ) {} } }
)");
    EXPECT_EQ(stack("/Char/Arm"),
              (Lines{"root /Char/Rig/ArmClass", "rig /Base/Rig/Arm", "rig /Base/Rig/ArmClass"}));
}

TEST_F(RelocatesTest, OpinionsAtTheSourceAreErrors) {
    write_char("</Char/Rig/Anim>: </Char/Anim>", "over \"Rig\" { over \"Anim\" {} }");
    EXPECT_EQ(stack("/Char/Anim"), (Lines{"rig /Base/Rig/Anim"}));
    EXPECT_EQ(errors(), (Lines{"opinion-at-relocation-source"}));
}

TEST_F(RelocatesTest, ArcsToWhatWasMovedAwayAreErrors) {
    write_char("</Char/Rig/Anim>: </Char/Anim>");
    std::ofstream(folder_ / "root.usda", std::ios::app)
        << "def \"Bad\" ( references = </Char/Rig/Anim> )\n{\n}\n"
        << "def \"Good\" ( references = </Char/Anim> )\n{\n}\n";
    EXPECT_EQ(stack("/Good"), (Lines{"root /Good", "rig /Base/Rig/Anim"}));
    EXPECT_TRUE(errors().empty());
    EXPECT_EQ(stack("/Bad"), (Lines{"root /Bad"}));
    EXPECT_EQ(errors().front(), "arc-to-prohibited-child");
}

TEST_F(RelocatesTest, ImpossibleOnesAreRefusedOneByOne) {
    write_char(
        "</Char/Rig>: </Char/Rig>, </Char/Last>: </Char/Last/In>, "
        "</Char/Rig/Anim>: </Char/Rig>, </Char>: </Other>, </Char/Rig/Other>: </Char/Moved>");
    EXPECT_EQ(children("/Char"), (Lines{"Rig", "Last", "Moved"}));
    EXPECT_EQ(std::as_const(composer()).errors().count(ErrorKind::InvalidAuthoredRelocation), 4u);
}

TEST_F(RelocatesTest, ContradictionsAreRefusedOnAllSides) {
    write_char("</Char/Rig>: </Char/To>, </Char/Last>: </Char/To>");
    EXPECT_EQ(children("/Char"), (Lines{"Rig", "Last"}));
    EXPECT_EQ(errors(), (Lines{"invalid-same-target-relocations"}));
    reopen();
    // The target of one is the source of the other; a source below another source
    write_char("</Char/Last>: </Char/Next>, </Char/Next>: </Char/To>");
    EXPECT_EQ(children("/Char"), (Lines{"Rig", "Last"}));
    EXPECT_EQ(errors(), (Lines(2, "invalid-conflicting-relocation")));
    reopen();
    write_char("</Char/Rig>: </Char/Bones>, </Char/Rig/Anim>: </Char/Anim>");
    EXPECT_EQ(children("/Char"), (Lines{"Bones", "Last"}));
    EXPECT_EQ(errors(), (Lines{"invalid-conflicting-relocation"}));
}

TEST_F(RelocatesTest, StrongerLayersDecideAboutASource) {
    write_char("</Char/Rig>: </Char/Weak>");
    std::filesystem::rename(folder_ / "root.usda", folder_ / "sub.usda");
    write("root.usda",
          "( subLayers = [@sub.usda@]\nrelocates = { </Char/Rig>: </Char/Strong> } )\n");
    EXPECT_EQ(children("/Char"), (Lines{"Strong", "Last"}));
}

TEST_F(RelocatesTest, ManyAtOnce) {
    std::string relocates, rig, targets_text;
    for (int i = 0; i < 300; ++i) {
        const std::string n = std::to_string(i);
        relocates += (i ? ", " : "") + ("</Char/Rig/A" + n + ">: </Char/B" + n + ">");
        rig += "def \"A" + n + "\" {}\n";
        targets_text += (i ? ", " : "") + ("</Base/Rig/A" + n + ">");
    }
    write("root.usda", "( relocates = { " + relocates + " } )\n" +
                           "def \"Char\" ( references = @rig.usda@</Base> ) {}\n");
    write("rig.usda",
          "def \"Base\" { def \"Rig\" { rel r = [" + targets_text + "]\n" + rig + "} }\n");
    EXPECT_EQ(children("/Char").size(), 301u);
    EXPECT_EQ(stack("/Char/B299"), (Lines{"rig /Base/Rig/A299"}));
    const Lines found = targets("/Char/Rig", "r");
    ASSERT_EQ(found.size(), 300u);
    EXPECT_EQ(found[7], "/Char/B7");
}

TEST_F(RelocatesTest, ElidedAncestorsComeToAnEnd) {
    // Relocations of relocated places, through three stacks
    write("root.usda", R"(( relocates = { </C/R/A>: </C/A>, </C/A/B>: </C/B> } )
def "C" ( references = @mid.usda@</C> ) {}
)");
    write("mid.usda", R"(( relocates = { </C/R/X>: </C/R/A> } )
def "C" ( references = @rig.usda@</Base> ) {}
)");
    write("rig.usda", "def \"Base\" { def \"R\" { def \"X\" { def \"B\" {} } } }\n");
    EXPECT_EQ(stack("/C/B"), (Lines{"rig /Base/R/X/B"}));
    EXPECT_EQ(stack("/C/A"), (Lines{"rig /Base/R/X"}));
    EXPECT_EQ(prohibited("/C/A"), (Lines{"B"}));
    EXPECT_EQ(children("/C"), (Lines{"R", "A", "B"}));
}

}  // namespace
}  // namespace velatura::usd::compose
