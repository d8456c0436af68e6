// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

namespace velatura::usd::layer {
namespace {

TEST(Path, PrintsWhatItReads) {
    for (const char* text : {"/",
                             ".",
                             "..",
                             "../..",
                             "/A",
                             "/A/B/C",
                             "A/B",
                             "../A",
                             "/A.b",
                             "/A.b:c:d",
                             ".b",
                             "../.b",
                             "/A{set=sel}",
                             "/A{set=}",
                             "/A{set=sel}B",
                             "/A{a=x}{b=y}C/D.e",
                             "/A.r[/T/U]",
                             "/A.r[/T.x].rel",
                             "/A.b.mapper[/C.d].arg",
                             "/A.b.expression",
                             "/M\xc3\xbcnchen/\xe6\x83\x85",
                             "/City/Street{selection=5thAvenue}",
                             "/A{v=.a|b-c}"}) {
        const auto path = Path::parse(text);
        ASSERT_TRUE(path) << text << ": " << path.error().message;
        EXPECT_EQ(path->to_string(), text);
    }
}

TEST(Path, RefusesWhatTheGrammarRefuses) {
    for (const char* text : {"",       "//",     "/A/",    "/A//B",     "/1A",     "/A.",
                             "/A.b:",  "/A.:b",  "/A{=}",  "/A{123=}",  "/A{s=a",  "/A b",
                             "/A.b.c", "/A[/B]", "/\\?*X", "/A{s=a/b}", "/A.b[/C", "/A/B{v=x y}",
                             "/.",     "/..",    "/\xff"}) {
        EXPECT_FALSE(Path::parse(text)) << text;
    }
}

TEST(Path, SamePathIsSamePointer) {
    EXPECT_EQ(Path::from("/A/B.c"),
              Path::absolute_root().append_child("A").append_child("B").append_property("c"));
    EXPECT_EQ(sizeof(Path), sizeof(void*));
    EXPECT_EQ(Path::from("/A{ set = sel }B"), Path::from("/A{set=sel}B"));
}

TEST(Path, ParentsAndParts) {
    const Path p = Path::from("/A{v=x}B.c");
    EXPECT_EQ(p.parent().to_string(), "/A{v=x}B");
    EXPECT_EQ(p.prim_path().to_string(), "/A{v=x}B");
    EXPECT_EQ(Path::from("/A{v=x}").prim_path().to_string(), "/A");
    EXPECT_EQ(p.strip_variant_selections().to_string(), "/A/B.c");
    EXPECT_EQ(p.name().str(), "c");
    EXPECT_TRUE(p.is_property());
    EXPECT_TRUE(p.has_variant_selection());
    EXPECT_TRUE(Path::from("/A").is_root_prim());
    EXPECT_FALSE(Path::from("/A/B").is_root_prim());
    EXPECT_TRUE(Path::absolute_root().parent().is_empty());
    EXPECT_EQ(Path::relative_root().parent().to_string(), "..");
    EXPECT_EQ(p.prefixes().size(), 4u);
}

TEST(Path, ReplacesPrefixAlsoInTargets) {
    const Path old_prefix = Path::from("/A/B");
    const Path new_prefix = Path::from("/X");
    EXPECT_EQ(Path::from("/A/B/C.d").replace_prefix(old_prefix, new_prefix).to_string(), "/X/C.d");
    EXPECT_EQ(Path::from("/A/BC").replace_prefix(old_prefix, new_prefix).to_string(), "/A/BC");
    EXPECT_EQ(Path::from("/Z.r[/A/B/T].s").replace_prefix(old_prefix, new_prefix).to_string(),
              "/Z.r[/X/T].s");
    EXPECT_EQ(Path::from("/Z.r[/A/B/T]").replace_prefix(old_prefix, new_prefix, false).to_string(),
              "/Z.r[/A/B/T]");
    EXPECT_EQ(Path::from("/A").replace_prefix(Path::absolute_root(), Path::from("/R")).to_string(),
              "/R/A");
}

TEST(Path, MakesAbsolute) {
    const Path anchor = Path::from("/A/B");
    EXPECT_EQ(Path::from("C.d").make_absolute(anchor).to_string(), "/A/B/C.d");
    EXPECT_EQ(Path::from("../C").make_absolute(anchor).to_string(), "/A/C");
    EXPECT_EQ(Path::from("..").make_absolute(anchor).to_string(), "/A");
    EXPECT_EQ(Path::from("../../C").make_absolute(anchor).to_string(), "/C");
    EXPECT_TRUE(Path::from("../../../C").make_absolute(anchor).is_empty());
    EXPECT_EQ(Path::from(".x").make_absolute(anchor).to_string(), "/A/B.x");
    EXPECT_EQ(Path::from("/Z").make_absolute(anchor).to_string(), "/Z");
}

TEST(Path, OrdersParentsBeforeChildrenTheSameWayAlways) {
    std::vector<Path> paths;
    const std::vector<std::string> expected = {"/",    "/A",   "/A{v=x}", "/A{v=x}B", "/A/B",
                                               "/A/C", "/A.a", "/A.b",    "/B"};
    for (const std::string& text : expected) paths.push_back(Path::from(text));
    std::reverse(paths.begin(), paths.end());
    std::sort(paths.begin(), paths.end());
    for (size_t i = 0; i < paths.size(); ++i) EXPECT_EQ(paths[i].to_string(), expected[i]);
}

TEST(Path, HasPrefixOnlyAtElements) {
    EXPECT_TRUE(Path::from("/A/B").has_prefix(Path::from("/A")));
    EXPECT_TRUE(Path::from("/A/B").has_prefix(Path::absolute_root()));
    EXPECT_TRUE(Path::from("/A").has_prefix(Path::from("/A")));
    EXPECT_FALSE(Path::from("/AB").has_prefix(Path::from("/A")));
    EXPECT_FALSE(Path::from("/A").has_prefix(Path::from("/A/B")));
}

TEST(Path, RefusesEndlessNesting) {
    std::string text;
    for (int i = 0; i < 100000; ++i) text += "/a";
    EXPECT_FALSE(Path::parse(text));
    std::string targets = "/a.b";
    for (int i = 0; i < 100000; ++i) targets += "[/a.b";
    EXPECT_FALSE(Path::parse(targets));
}

TEST(Path, InternsFromManyThreads) {
    std::vector<std::vector<Path>> seen(4);
    std::vector<std::thread> threads;
    for (auto& list : seen) {
        threads.emplace_back([&list] {
            for (int i = 0; i < 2000; ++i)
                list.push_back(Path::from("/Thread/p" + std::to_string(i) + ".x"));
        });
    }
    for (std::thread& t : threads) t.join();
    for (const auto& list : seen) EXPECT_EQ(list, seen[0]);
}

TEST(Token, ComparesByTextAndPointer) {
    EXPECT_EQ(Token("abc"), Token(std::string("ab") + "c"));
    EXPECT_LT(Token("a"), Token("b"));
    EXPECT_TRUE(Token("").empty());
    EXPECT_EQ(Token(""), Token());
    EXPECT_EQ(sizeof(Token), sizeof(void*));
}

TEST(Identifier, FollowsUnicodeXid) {
    EXPECT_TRUE(
        is_identifier("_\xc3\xbc"
                      "9"));
    EXPECT_TRUE(
        is_identifier("\xe2\x85\x88"
                      "573"));  // U+2148, XID_Start
    EXPECT_FALSE(is_identifier("9a"));
    EXPECT_FALSE(is_identifier("a-b"));
    EXPECT_FALSE(
        is_identifier("\xe3\xa4\xbc"
                      "01\xe0\xa7\xaa\xe2\x88\xab"));  // ends in U+222B, an integral sign
    EXPECT_FALSE(is_identifier("\xc0\x80"));
    EXPECT_TRUE(is_namespaced_identifier("a:b:c"));
    EXPECT_FALSE(is_namespaced_identifier("a::b"));
    EXPECT_TRUE(is_variant_name(".7he|W-o_r|k-5_"));
    EXPECT_FALSE(is_variant_name("bad.name"));
}

}  // namespace
}  // namespace velatura::usd::layer
