// SPDX-License-Identifier: Apache-2.0
// UsdLux light and shadow linking, and ShadowAPI. Oracle: the documentation of UsdLuxLightAPI,
// UsdCollectionAPI and UsdLuxShadowAPI.
#include "translate/support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace velatura::translate::linking {

namespace {

using scene::LinkClass;
using scene::LinkSetId;

constexpr float infinity = std::numeric_limits<float>::infinity();

bool holds(const scene::Scene& scene, LinkSetId set, LinkClass c) {
    return set == scene::none || scene.linking.sets[set].holds(c);
}

/// Names of the shapes placed directly that are in the set.
std::string direct_members(const scene::Scene& scene, LinkSetId set) {
    std::string names;
    for (const scene::Shape& shape : scene.shapes) {
        const std::string& path = scene.provenance[shape.provenance].prim_path;
        if (holds(scene, set, shape.link)) names += path.substr(path.rfind('/') + 1) + " ";
    }
    return names;
}

/// For each instance a letter per shape: whether it is in the set.
std::string instance_members(const scene::Scene& scene, LinkSetId set) {
    std::string text;
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const size_t shapes = scene.prototypes[scene.instances[i].prototype].shapes.size();
        for (uint32_t s = 0; s < shapes; ++s)
            text += holds(scene, set, scene::link_class(scene, i, s)) ? 'y' : 'n';
        text += ' ';
    }
    return text;
}

std::string light(const std::string& name, const std::string& body) {
    return "def SphereLight \"" + name + "\" (prepend apiSchemas = [\"ShadowAPI\"]) {\n" + body +
           "\n}\n";
}

std::string shelf() {
    return "def Xform \"Shelf\" {\n" + quad("A") + quad("B") + "def Xform \"Box\" {\n" + quad("C") +
           quad("D") + "}\n}\n" + quad("Floor");
}

/// What the light of this body shines on.
std::string lit(const std::string& body) {
    Translated t;
    translate_text(camera() + shelf() + light("L", body), t);
    EXPECT_EQ(t.error, "");
    EXPECT_EQ(t.scene.lights.at(0).links.casters, scene::none);
    return direct_members(t.scene, t.scene.lights.at(0).links.lit);
}

scene::LightLinks links(const std::string& body, const char* code = nullptr) {
    Translated t;
    translate_text(camera() + quad("Q") + light("L", body), t);
    EXPECT_EQ(t.diagnostics.warning_count(), code ? 1u : 0u) << body;
    if (code) {
        EXPECT_EQ(t.count(code), 1u) << body;
    }
    return t.scene.lights.at(0).links;
}

constexpr const char* no_root = "uniform bool collection:lightLink:includeRoot = 0\n";

}  // namespace

TEST(Linking, IsToEverythingWhereNobodySaysOtherwise) {
    Translated t;
    translate_text(camera() + shelf() + light("L", ""), t);
    EXPECT_EQ(t.scene.lights[0].links, scene::LightLinks());
    EXPECT_TRUE(t.scene.linking.sets.empty());
    EXPECT_EQ(t.diagnostics.warning_count(), 0u);
}

TEST(Linking, GoesByTheDeepestRuleAndDownToDescendants) {
    EXPECT_EQ(lit("rel collection:lightLink:excludes = </Shelf>"), "Floor ");
    EXPECT_EQ(lit("rel collection:lightLink:excludes = </Shelf/A>"), "Floor B C D ");
    EXPECT_EQ(lit("rel collection:lightLink:excludes = </Shelf>\n"
                  "rel collection:lightLink:includes = </Shelf/Box>"),
              "Floor C D ");
    EXPECT_EQ(lit(std::string(no_root) + "rel collection:lightLink:includes = </Shelf>\n"
                                         "rel collection:lightLink:excludes = </Shelf/Box/C>"),
              "A B D ");
    // The root counts although others are included
    EXPECT_EQ(lit("rel collection:lightLink:includes = </Shelf/A>"), "Floor A B C D ");
    EXPECT_EQ(lit(no_root), "");
}

TEST(Linking, FollowsExpansionRulesAndOtherCollections) {
    const std::string only =
        std::string(no_root) +
        "uniform token collection:lightLink:expansionRule = \"explicitOnly\"\n";
    EXPECT_EQ(lit(only + "rel collection:lightLink:includes = [</Shelf>, </Shelf/B>]"), "B ");
    EXPECT_EQ(lit(std::string(no_root) + "rel collection:lightLink:includes = </L.collection:set>\n"
                                         "rel collection:set:includes = </Shelf/Box>\n"
                                         "uniform token collection:set:expansionRule = "
                                         "\"expandPrims\""),
              "C D ");
}

TEST(Linking, FollowsPathExpressions) {
    EXPECT_EQ(
        lit(std::string(no_root) +
            "pathExpression collection:lightLink:membershipExpression = \"/Shelf//{isa:Mesh} - "
            "/Shelf/Box/C\""),
        "A B D ");
    Translated t;
    translate_text(camera() + shelf() +
                       light("L",
                             "pathExpression collection:lightLink:membershipExpression = "
                             "\"/Shelf/A\""),
                   t);
    EXPECT_EQ(t.scene.lights[0].links.lit, scene::none);
    EXPECT_EQ(t.count("idle-membership-expression"), 1u);
}

TEST(Linking, ExcludedCollectionsAreNamedAndExcludeNothing) {
    Translated t;
    translate_text(
        camera() + shelf() +
            light("L",
                  "rel collection:lightLink:excludes = [</L.collection:set>, </Shelf/A>]\n"
                  "rel collection:set:includes = </Shelf/Box>\n"
                  "uniform token collection:set:expansionRule = \"expandPrims\""),
        t);
    EXPECT_EQ(t.count("excluded-collection"), 1u);
    EXPECT_NE(t.messages("excluded-collection").find("</L.collection:set>"), std::string::npos);
}

TEST(Linking, OfEverythingByNameIsNoLinking) {
    Translated t;
    translate_text(camera() + shelf() +
                       light("L", std::string(no_root) +
                                      "rel collection:lightLink:includes = [</Shelf>, </Floor>]\n"
                                      "rel collection:shadowLink:excludes = </Nowhere>"),
                   t);
    EXPECT_EQ(t.scene.lights[0].links, scene::LightLinks());
    EXPECT_TRUE(t.scene.linking.sets.empty());
    EXPECT_EQ(t.scene.linking.class_count, 1u);
    for (const scene::Shape& shape : t.scene.shapes) EXPECT_EQ(shape.link, 0u);
}

TEST(Linking, OfShadowsIsApartFromThatOfLight) {
    Translated t;
    translate_text(camera() + shelf() +
                       light("L",
                             "rel collection:lightLink:excludes = </Shelf/A>\n"
                             "rel collection:shadowLink:excludes = </Shelf/Box>") +
                       light("M", "rel collection:shadowLink:excludes = </Shelf/Box>") +
                       light("N", ""),
                   t);
    const auto& lights = t.scene.lights;
    EXPECT_EQ(direct_members(t.scene, lights[0].links.lit), "Floor B C D ");
    EXPECT_EQ(direct_members(t.scene, lights[0].links.casters), "Floor A B ");
    EXPECT_EQ(lights[1].links.lit, scene::none);
    EXPECT_EQ(lights[1].links.casters, lights[0].links.casters) << "the same set";
    EXPECT_EQ(lights[2].links, scene::LightLinks());
    EXPECT_EQ(t.scene.linking.sets.size(), 2u);
    EXPECT_EQ(t.scene.linking.class_count, 3u) << "what is in all, A, C with D";
}

TEST(Linking, TellsNativeInstancesApartAndWhatIsInThem) {
    const std::string pair = "class Xform \"Pair\" {\n" + quad("P") + quad("Q") + R"(
    def SphereLight "Bulb" {
        rel collection:shadowLink:excludes = </Pair/P>
    }
}
def Xform "A" (instanceable = true
    inherits = </Pair>) {}
def Xform "B" (instanceable = true
    inherits = </Pair>) {}
)";
    Translated t;
    translate_text(
        camera() + pair + light("L", "rel collection:lightLink:excludes = [</A>, </B/Q>]"), t);
    ASSERT_EQ(t.scene.prototypes.size(), 1u);
    ASSERT_EQ(t.scene.lights.size(), 3u);
    EXPECT_EQ(instance_members(t.scene, t.scene.lights[0].links.lit), "nn yn ");
    // Each bulb excludes what is beside it
    EXPECT_EQ(instance_members(t.scene, t.scene.lights[1].links.casters), "ny yy ");
    EXPECT_EQ(instance_members(t.scene, t.scene.lights[2].links.casters), "yy ny ");
}

TEST(Linking, ReachesInstancesWithinInstances) {
    const std::string nested = "class Xform \"Inner\" {\n" + quad("Q") + R"(}
class Xform "Outer" {
    def Xform "I" (instanceable = true
        inherits = </Inner>) {}
    def Xform "J" (instanceable = true
        inherits = </Inner>) {}
}
def Xform "A" (instanceable = true
    inherits = </Outer>) {}
def Xform "B" (instanceable = true
    inherits = </Outer>) {}
)";
    Translated t;
    translate_text(camera() + nested + light("L", "rel collection:lightLink:excludes = </B/I>"), t);
    EXPECT_EQ(instance_members(t.scene, t.scene.lights[0].links.lit), "y y n y ");
}

TEST(Linking, OfPointInstancersGoesByThePrototypeThenByTheInstancer) {
    const auto members = [](const std::string& body) {
        Translated t;
        translate_text(camera() + "over \"Protos\" {\n" + quad("P") + R"(}
def PointInstancer "I" {
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    rel prototypes = [</Protos/P>, </I/Q>]
)" + quad("Q") + "}\n" + R"(
def PointInstancer "J" {
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 0)]
    rel prototypes = </Protos/P>
}
)" + light("L", body),
                       t);
        EXPECT_EQ(t.error, "");
        return instance_members(t.scene, t.scene.lights.at(0).links.lit);
    };
    // Instances: P and Q by I, P by J
    EXPECT_EQ(members("rel collection:lightLink:excludes = </I>"), "n n y ");
    EXPECT_EQ(members("rel collection:lightLink:excludes = </Protos/P>"), "n y n ");
    EXPECT_EQ(members("rel collection:lightLink:excludes = </I/Q>"), "y n y ");
    EXPECT_EQ(members("rel collection:lightLink:excludes = </I>\n"
                      "rel collection:lightLink:includes = </Protos>"),
              "y n y ");
    EXPECT_EQ(members(std::string(no_root) + "rel collection:lightLink:includes = </J>"), "n n y ");
    EXPECT_EQ(members(std::string(no_root) +
                      "pathExpression collection:lightLink:membershipExpression = \"/J /I/Q\""),
              "n y y ");
}

TEST(Linking, IsForGeometryThatIsALightToo) {
    Translated t;
    translate_text(camera() + shelf() + R"(
def Mesh "Lamp" (prepend apiSchemas = ["MeshLightAPI"]) {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
    rel collection:lightLink:excludes = </Shelf>
    bool inputs:shadow:enable = 0
}
)",
                   t);
    ASSERT_EQ(t.scene.mesh_lights.size(), 1u);
    const scene::LightLinks& links = t.scene.mesh_lights[0].links;
    EXPECT_EQ(direct_members(t.scene, links.lit), "Floor Lamp ");
    EXPECT_TRUE(t.scene.linking.sets.at(links.casters).is_empty());
}

TEST(Linking, TellsTheFacesOfSubsetsApart) {
    const std::string mesh = R"(
def Mesh "M" {
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 1, 2, 3, 2, 3, 4, 3, 4, 5]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0), (1, 2, 0)]
    uniform token subdivisionScheme = "none"
    int[] holeIndices = [0]
    color3f[] primvars:displayColor = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)] (
        interpolation = "uniform"
    )
    def GeomSubset "Low" {
        uniform token elementType = "face"
        int[] indices = [0, 1]
    }
    def GeomSubset "High" {
        uniform token elementType = "face"
        int[] indices = [3]
    }
}
)";
    // By the first component of each face's color: 1, 2, 3
    const auto faces = [&](const std::string& body) {
        Translated t;
        translate_text(camera() + mesh + light("L", body), t);
        EXPECT_EQ(t.error, "");
        std::string found;
        size_t count = 0;
        for (size_t i = 0; i < t.scene.shapes.size(); ++i) {
            const scene::Mesh& part = t.mesh(i);
            count += part.face_vertex_counts.size();
            EXPECT_EQ(part.face_vertex_indices.size(), 3 * part.face_vertex_counts.size());
            EXPECT_EQ(t.scene.provenance[t.scene.shapes[i].provenance].prim_path, "/M");
            if (!holds(t.scene, t.scene.lights.at(0).links.lit, t.scene.shapes[i].link)) continue;
            for (size_t f = 0; f < part.face_vertex_counts.size(); ++f)
                found += fmt::format("{}", part.primvars.at(0).values.at(3 * f));
        }
        EXPECT_EQ(count, 3u);
        std::sort(found.begin(), found.end());
        return found + fmt::format(" of {}", t.scene.shapes.size());
    };
    EXPECT_EQ(faces(""), "123 of 1");
    EXPECT_EQ(faces("rel collection:lightLink:excludes = </M/Low>"), "23 of 2");
    EXPECT_EQ(faces("rel collection:lightLink:excludes = [</M/Low>, </M/High>]"), "2 of 3");
    EXPECT_EQ(faces(std::string(no_root) + "rel collection:lightLink:includes = </M/High>"),
              "3 of 2");
    EXPECT_EQ(faces("rel collection:lightLink:excludes = </M>\n"
                    "rel collection:lightLink:includes = </M/High>"),
              "3 of 2");
    EXPECT_EQ(faces("rel collection:lightLink:excludes = </M>"), " of 1");
    EXPECT_EQ(faces(std::string(no_root) +
                    "pathExpression collection:lightLink:membershipExpression = \"/M/Low\""),
              "1 of 2");
}

TEST(Linking, OfLightsOnInstancedGeometryIsNamed) {
    Translated t;
    translate_text(camera() + "class Xform \"Pair\" {\n" + quad("P") + R"(
    def Sphere "Lamp" (prepend apiSchemas = ["LightAPI"]) {
        rel collection:lightLink:excludes = </Pair/P>
    }
}
def Xform "A" (instanceable = true
    inherits = </Pair>) {}
def Xform "B" (instanceable = true
    inherits = </Pair>) {}
)",
                   t);
    EXPECT_EQ(t.count("unsupported-light-linking"), 1u);
}

TEST(Shadows, AreReadAsTheSchemaSays) {
    const scene::LightLinks plain = links("");
    EXPECT_FALSE(plain.has_custom_shadows());
    EXPECT_FALSE(links("bool inputs:shadow:enable = 1\nfloat inputs:shadow:distance = -1\n"
                       "float inputs:shadow:falloff = 3\ncolor3f inputs:shadow:color = (0, 0, 0)")
                     .has_custom_shadows())
        << "a falloff requires a distance";
    const scene::LightLinks far = links("float inputs:shadow:distance = 4");
    EXPECT_EQ(far.shadow_distance, 4.0f);
    EXPECT_EQ(far.shadow_falloff, 0.0f);
    const scene::LightLinks fading = links(
        "float inputs:shadow:distance = 4\nfloat inputs:shadow:falloff = 1.5\n"
        "float inputs:shadow:falloffGamma = 2\ncolor3f inputs:shadow:color = (0.1, 0.2, 0.3)");
    EXPECT_EQ(fading.shadow_falloff, 1.5f);
    EXPECT_EQ(fading.shadow_falloff_gamma, 2.0f);
    EXPECT_EQ(fading.shadow_color, Rgb(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(
        links("float inputs:shadow:distance = 4\nfloat inputs:shadow:falloff = 9").shadow_falloff,
        4.0f)
        << "the zone cannot exceed the distance";
    EXPECT_TRUE(links("float inputs:shadow:distance = 0").has_custom_shadows());
    // Without shadows the rest says nothing
    const scene::LightLinks off = links(
        "bool inputs:shadow:enable = 0\n"
        "color3f inputs:shadow:color = (1, 0, 0)");
    EXPECT_NE(off.casters, scene::none);
    EXPECT_EQ(off.shadow_color, Rgb(0.0f));
}

TEST(Shadows, ThatMakeNoSenseAreNamed) {
    EXPECT_EQ(links("color3f inputs:shadow:color = (-1, 0, 0)", "bad-light-value"),
              scene::LightLinks());
    EXPECT_EQ(links("float inputs:shadow:distance = nan", "bad-light-value").shadow_distance,
              infinity);
    EXPECT_EQ(links("float inputs:shadow:distance = 2\nfloat inputs:shadow:falloff = 1\n"
                    "float inputs:shadow:falloffGamma = -2",
                    "bad-light-value")
                  .shadow_falloff_gamma,
              1.0f);
}

}  // namespace velatura::translate::linking
