// SPDX-License-Identifier: Apache-2.0
// Light path expressions: what they match, held against a matcher by brute force, and what is wrong
// with them.
#include "film/light_path_expression.h"
#include "film/lobe_layers.h"
#include "film/path_automaton.h"
#include "film/path_labels.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace velatura::film {

namespace {

const std::vector<accumulate::LightGroup> groups = {{"key", {"/key"}, false},
                                                    {"sky", {"/sky"}, true},
                                                    {"fill2", {"/fill 2"}, false, "fill 2"},
                                                    {"emissive", {}, false}};
constexpr int key = 0, sky = 1, fill = 2, emissive = 3;

Result<PathAutomaton> automaton(const std::string& text, bool is_strict = false) {
    return PathAutomaton::make({make_path_layer("x", text, "paths")}, is_strict, groups);
}

using Events = std::vector<PathEvent>;

bool matches(const PathAutomaton& a, const Events& events, int group) {
    PathAutomaton::State state = a.start();
    for (const PathEvent e : events) {
        if (state == PathAutomaton::dead) return false;
        state = a.next(state, e);
    }
    return state != PathAutomaton::dead && !a.layers_of(state, group).empty();
}

bool matches(const std::string& text, const Events& events, int group, bool is_strict = false) {
    const Result<PathAutomaton> a = automaton(text, is_strict);
    EXPECT_TRUE(a.has_value()) << (a ? "" : a.error().message);
    return a && matches(*a, events, group);
}

/// By the definition alone: tries every way to split the word.
bool matches_by_force(const PathPattern& p,
                      const std::vector<size_t>& word,
                      size_t begin,
                      size_t end) {
    using Kind = PathPattern::Kind;
    const auto sequence = [&](const auto& self, size_t part, size_t at) -> bool {
        if (part == p.parts.size()) return at == end;
        for (size_t to = at; to <= end; ++to)
            if (matches_by_force(p.parts[part], word, at, to) && self(self, part + 1, to))
                return true;
        return false;
    };
    const auto repeat = [&](const auto& self, int count, size_t at) -> bool {
        if (at == end && count >= p.min) return true;
        if (p.max >= 0 && count >= p.max) return false;
        for (size_t to = at; to <= end; ++to) {
            if (to == at && count >= p.min) continue;  // nothing, once more
            if (matches_by_force(p.parts[0], word, at, to) && self(self, count + 1, to))
                return true;
        }
        return false;
    };
    switch (p.kind) {
        case Kind::Event:
            return end == begin + 1 && p.event[word[begin]];
        case Kind::Choice:
            return std::any_of(p.parts.begin(), p.parts.end(), [&](const PathPattern& part) {
                return matches_by_force(part, word, begin, end);
            });
        case Kind::Sequence:
            return sequence(sequence, 0, begin);
        case Kind::Repeat:
            return repeat(repeat, 0, begin);
    }
    return false;
}

std::string message_of(const std::string& text) {
    const Result<PathAutomaton> a = automaton(text);
    return a ? "no error" : a.error().message;
}

}  // namespace

TEST(LightPaths, MatchWhatTheirLettersSay) {
    using enum PathEvent;
    EXPECT_TRUE(matches("C[LOB]", {}, key));
    EXPECT_FALSE(matches("C[LOB]", {Diffuse}, key));
    EXPECT_TRUE(matches("C<RD>L", {Diffuse}, key));
    EXPECT_FALSE(matches("C<RD>L", {Diffuse}, emissive));
    EXPECT_TRUE(matches("C<RD>L", {Diffuse}, sky)) << "domes are lights";
    EXPECT_TRUE(matches("C<RD>B", {Diffuse}, sky));
    EXPECT_FALSE(matches("C<RD>B", {Diffuse}, key));
    EXPECT_TRUE(matches("C<RD>O", {Subsurface}, emissive));
    EXPECT_TRUE(matches("lpe:C.{2}<L.'key'>", {Glossy, Volume}, key));
    EXPECT_FALSE(matches("C.{2}<L.'key'>", {Glossy, Volume}, fill));
    EXPECT_TRUE(matches("C.{2,}<L.'fill 2'>", {Glossy, Volume, Mirror}, fill))
        << "by the light's own name";
    EXPECT_TRUE(matches("C.+<.'env'>", {Glossy}, sky));
    EXPECT_FALSE(matches("C.+<.'env'>", {Glossy}, fill));
    EXPECT_TRUE(matches("C.*", {Glossy, Diffuse, Volume}, emissive));
    EXPECT_TRUE(matches("C<RD>[RT]*L | C V .* O", {Volume, Volume}, emissive));
    EXPECT_TRUE(matches("CD[^D]*L", {Diffuse, Glossy, Mirror, Volume}, key));
    EXPECT_FALSE(matches("CD[^D]*L", {Diffuse, Glossy, Diffuse}, key));
    EXPECT_TRUE(matches("C<[RT]G>L", {GlossyTransmission}, key));
    EXPECT_TRUE(matches("C<R.['coat''subsurface']>L", {MirrorCoat}, key));
    EXPECT_FALSE(matches("C<R.[^'coat']>L", {MirrorCoat}, key));
    EXPECT_TRUE(matches("C(SD){2}S{0,1}L", {Mirror, Diffuse, Glossy, Diffuse}, key));
}

TEST(LightPaths, TakeEitherLetterForSpecularUnlessStrict) {
    using enum PathEvent;
    for (const PathEvent e : {Glossy, Mirror, GlossyCoat, MirrorCoat}) {
        const bool is_mirror = e == Mirror || e == MirrorCoat;
        EXPECT_TRUE(matches("C<RG>L", {e}, key));
        EXPECT_TRUE(matches("CSL", {e}, key));
        EXPECT_EQ(matches("C<RG>L", {e}, key, true), !is_mirror);
        EXPECT_EQ(matches("C<RS>L", {e}, key, true), is_mirror);
    }
}

TEST(LightPaths, AgreeWithBruteForce) {
    // Random expressions, every path of up to four scatterings of some events
    std::mt19937 random(7);
    const auto pick = [&random](int n) { return int(random() % uint32_t(n)); };
    const std::vector<std::string> atoms = {
        "D", "S", ".", "<R.>", "T", "V", "[DV]", "[^S]", "<RD'subsurface'>", "<..'coat'>"};
    const auto expression = [&](const auto& self, int depth) -> std::string {
        std::string text;
        for (int parts = 1 + pick(3); parts > 0; --parts) {
            std::string item = depth > 0 && pick(3) == 0
                                   ? "(" + self(self, depth - 1) +
                                         (pick(2) ? "|" + self(self, depth - 1) : "") + ")"
                                   : atoms[size_t(pick(int(atoms.size())))];
            const char* const repeats[] = {"", "", "", "*", "+", "{2}", "{0,2}", "{1,}"};
            text += item + repeats[pick(8)];
        }
        return text;
    };
    constexpr std::array events = {PathEvent::Diffuse,    PathEvent::Subsurface, PathEvent::Mirror,
                                   PathEvent::GlossyCoat, PathEvent::Refraction, PathEvent::Volume};
    const PathSymbols symbols(groups);
    const char* const ends[] = {"L", "[LO]", "<L.'key'>", "B", "."};
    int checked = 0, matched = 0, refused = 0;
    for (int i = 0; i < 120; ++i) {
        const std::string text = "C" + expression(expression, 2) + ends[pick(5)];
        const Result<PathAutomaton> a = automaton(text);
        const Result<PathPattern> pattern = parse_path_expression(text, symbols, false);
        ASSERT_TRUE(pattern.has_value()) << text;
        if (!a) {
            // Some tell too many paths apart
            ASSERT_NE(a.error().message.find("more than"), std::string::npos) << a.error().message;
            ++refused;
            continue;
        }
        for (int length = 0; length <= 4; ++length) {
            const int words = int(std::pow(double(events.size()), length));
            for (int w = 0; w < words; w += 1 + pick(7)) {
                Events path;
                for (int k = 0, rest = w; k < length; ++k, rest /= int(events.size()))
                    path.push_back(events[size_t(rest) % events.size()]);
                const int group = pick(4);
                std::vector<size_t> word = {PathSymbols::camera};
                for (const PathEvent e : path) word.push_back(PathSymbols::of(e));
                word.push_back(PathSymbols::of_group(size_t(group)));
                const bool expected = matches_by_force(*pattern, word, 0, word.size());
                ASSERT_EQ(matches(*a, path, group), expected)
                    << text << ", word " << w << " of " << length;
                ++checked;
                matched += expected;
            }
        }
    }
    fmt::print("{} paths, {} matched; {} expressions refused\n", checked, matched, refused);
    EXPECT_LT(refused, 20);
    EXPECT_GT(matched, 1000);
}

TEST(LightPaths, TogetherAreWhatEachIsAlone) {
    const std::vector<std::string> texts = {"C<RD>L", "C.+<L.'key'>", "C.*SD.*L", "C[LOB]",
                                            "C(SD)*L"};
    std::vector<accumulate::PathLayer> layers;
    for (const std::string& text : texts) layers.push_back(make_path_layer("x", text, "paths"));
    const Result<PathAutomaton> all = PathAutomaton::make(layers, false, groups);
    ASSERT_TRUE(all.has_value());
    std::mt19937 random(3);
    for (int i = 0; i < 2000; ++i) {
        Events path(random() % 6);
        for (PathEvent& e : path) e = PathEvent(random() % path_event_count);
        const int group = int(random() % 4);
        PathAutomaton::State state = all->start();
        for (const PathEvent e : path)
            if (state != PathAutomaton::dead) state = all->next(state, e);
        for (size_t k = 0; k < texts.size(); ++k) {
            bool is_in = false;
            if (state != PathAutomaton::dead) {
                const auto& list = all->layers_of(state, group);
                is_in = std::find(list.begin(), list.end(), uint16_t(k)) != list.end();
            }
            ASSERT_EQ(is_in, matches(*automaton(texts[k]), path, group)) << texts[k];
        }
    }
}

TEST(LightPaths, LobesDivideEveryPath) {
    const Result<PathAutomaton> a = PathAutomaton::make(lobe_layers(), true, groups);
    ASSERT_TRUE(a.has_value()) << a.error().message;
    for (size_t first = 0; first < path_event_count; ++first) {
        for (size_t second = 0; second < path_event_count; ++second) {
            const PathAutomaton::State one = a->next(a->start(), PathEvent(first)),
                                       two = a->next(one, PathEvent(second));
            for (int g = 0; g < 4; ++g) {
                EXPECT_EQ(a->layers_of(a->start(), g).size(), 1u);
                EXPECT_EQ(a->layers_of(one, g).size(), 1u) << first;
                EXPECT_EQ(a->layers_of(two, g).size(), 1u) << first << " " << second;
            }
        }
    }
    fmt::print("{} states\n", a->state_count());
}

TEST(LightPaths, SayWhatIsWrongAndWhere) {
    const struct {
        const char *text, *why;
    } cases[] = {
        {"", "column 1: expected an event, found the end"},
        {"C<RD", "column 5: expected > to close the event"},
        {"C<RDx>L", "column 5: expected a label in ' ' or '.', found \"x\""},
        {"CXL", "column 2: expected one of C R T V L O B D G S or '.', found \"X\""},
        {"CD?L", "column 3: ? is not supported"},
        {"C.**L", "repeats a repetition"},
        {"C.{2L", "column 5: expected } after the count"},
        {"C.{99}L", "column 4: expected a count of 0 to 64"},
        {"C.{3,2}L", "the second count is below the first"},
        {"C(DL", "column 5: expected ) to close the bracket"},
        {"C[DL", "column 5: expected ] to close the set"},
        {"CD)L", "column 3: unexpected \")\""},
        {"C<sD>L", "s matches nothing"},
        {"C<R<D>>L", "groups within < > are not supported"},
        {"C<RD>A", "A (albedo) is not supported"},
        {"C<L.'kay'>", "column 5: unknown light group or lobe 'kay' (did you mean 'key'"},
        {"C<L.'key>", "column 5: expected ' to close the label"},
        {"C<RD>", "no path can match it"},
        {"DL", "no path can match it"},
        {"C<RL>", "column 4: expected one of D G S or '.', found \"L\""},
        {"unoccluded;C.+L", "exists for direct light only"},
        {"shadow;CL", "exists for direct light only"},
    };

    for (const auto& c : cases)
        EXPECT_NE(message_of(c.text).find(c.why), std::string::npos)
            << c.text << ": " << message_of(c.text);
    EXPECT_EQ(message_of("shadow;C.<L.'key'>"), "no error");
    EXPECT_EQ(message_of("unoccluded;C<RD>L"), "no error");
}

TEST(LightPaths, KnowGroupsAsTheSceneCallsThem) {
    // A group that layers call key1 comes from key_1; the light key1 got another name
    const std::vector<accumulate::LightGroup> two = {{"key1", {"/key_1"}, false, "key_1"},
                                                     {"key12", {"/key1"}, false, "key1"}};
    const auto wanted = [&](const std::string& label) {
        const auto a = PathAutomaton::make({make_path_layer("x", "CL", "paths"),
                                            make_path_layer("y", "C<L.'" + label + "'>", "paths")},
                                           false, two);
        EXPECT_TRUE(a.has_value()) << label;
        std::string groups_of;
        for (int g = 0; a && g < 2; ++g)
            groups_of += a->layers_of(a->start(), g).size() == 2 ? "1" : "0";
        return groups_of;
    };
    EXPECT_EQ(wanted("key_1"), "10");
    EXPECT_EQ(wanted("key1"), "01");
    EXPECT_EQ(wanted("key12"), "01");
    // There is no dome, which is no mistake
    EXPECT_EQ(wanted("env"), "00");
}

TEST(LightPaths, HugeOnesAreRefusedSoon) {
    EXPECT_NE(message_of("C" + std::string(5000, 'D') + "L").find("exceeds the maximum of 4096"),
              std::string::npos);
    EXPECT_NE(message_of("C" + std::string(200, '(') + "D" + std::string(200, ')') + "L")
                  .find("nested deeper"),
              std::string::npos);
    EXPECT_NE(message_of("C((((.{64}){64}){64}){64}){64}L").find("too long"), std::string::npos);
    EXPECT_NE(message_of("C((.*D){0,64}){0,64}L"), "no error");
    EXPECT_NE(message_of("C((.*D){0,63}){0,63}(.*V){0,64}L"), "no error");
    // A state for every way to have met D or not in the last 20 events
    EXPECT_NE(message_of("C.*D.{20}L").find("more than 512"), std::string::npos);
}

TEST(PathLabels, PartsAddUpAndFollowShares) {
    // Of a path that is half diffuse at each of three vertices, 3 of 8 parts are diffuse twice
    std::vector<accumulate::PathLayer> layers;
    for (const char* text : {"C.*L", "C(S*DS*DS*)L", "CSSSL"})
        layers.push_back(make_path_layer("x", text, "paths"));
    PathLabels labels(PathAutomaton::make(layers, false, groups).value());
    EventShares half;
    half.add(PathEvent::Diffuse, {0.5, 0.5, 0.5});
    half.add(PathEvent::Glossy, {0.5, 0.5, 0.5});
    const auto part_of = [&](size_t layer) {
        double sum = 0;
        for (const auto& [state, part] : labels.parts()) {
            const auto& list = labels.automaton().layers_of(state, key);
            if (std::find(list.begin(), list.end(), uint16_t(layer)) != list.end()) sum += part.y;
        }
        return sum;
    };
    for (int i = 0; i < 3; ++i) {
        // Light looked for elsewhere leaves no trace
        labels.look(EventShares::only(PathEvent::Volume));
        labels.stay();
        labels.look(half);
        labels.go();
    }
    EXPECT_EQ(part_of(0), 1.0);
    EXPECT_EQ(part_of(1), 3.0 / 8);
    EXPECT_EQ(part_of(2), 1.0 / 8);
    // A light without diffuse meets what the last scattering made specular
    labels.weigh(0.0f, 1.0f);
    EXPECT_EQ(part_of(0), 1.0);
    EXPECT_EQ(part_of(1), 1.0 / 4);
    EXPECT_EQ(part_of(2), 1.0 / 4);
    labels.stay();
    EXPECT_EQ(part_of(2), 1.0 / 8);
    // A branch forgets what the one before it did, also what its last scattering was
    const PathLabels::PathPrefix prefix = labels.prefix();
    labels.look(EventShares::only(PathEvent::Diffuse));
    labels.go();
    labels.restore(prefix);
    labels.weigh(0.0f, 1.0f);
    EXPECT_EQ(part_of(2), 1.0 / 4);
    labels.begin();
    EXPECT_EQ(part_of(0), 1.0);
    EXPECT_EQ(part_of(1), 0.0);
}

}  // namespace velatura::film
