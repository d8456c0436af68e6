// SPDX-License-Identifier: Apache-2.0
// Every attribute that docs/reference/usd_support.md calls used, alone in a small stage: with it
// the image is another one than without it, and equals the closed form or the image of a twin,
// which says the same by other means. The list comes from the tables of the code: an attribute that
// is declared in src/usd/stage/generated, is not among translate::unused_attributes() and has no
// row here fails.
#include "schema_attributes.h"

#include "translate/schema_support.h"
#include "translate/translate.h"
#include "usd/stage/schema_tables.h"
#include "usd/stage/stage.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <utility>

namespace velatura::test {

namespace {

constexpr int width = 16, height = 12;

/// Takes a line `@mark VALUE` out of the text; nothing when there is none.
std::optional<std::string> take_mark(std::string& text, const std::string& mark) {
    const size_t begin = text.find(mark);
    if (begin == std::string::npos) return std::nullopt;
    const size_t end = text.find('\n', begin);
    const std::string value = text.substr(begin + mark.size(), end - begin - mark.size());
    text.erase(begin, end + 1 - begin);
    return value;
}

/// Ends every statement before a brace that closes.
std::string with_ends(std::string prims) {
    for (size_t at = 0; (at = prims.find(" }", at)) != std::string::npos;) prims[at] = '\n';
    return prims;
}

std::string whole(std::string prims) {
    if (prims.starts_with('#')) return prims;
    const bool is_dark = take_mark(prims, "@dark").has_value();
    const std::string close = take_mark(prims, "@close ").value_or("0");
    return R"usda(#usda 1.0
def Camera "Cam" {
    token projection = "orthographic"
    float horizontalAperture = 40
    float verticalAperture = 30
    double shutter:close = )usda" +
           close + "\n" + at("(0, 0, 10)") +
           "}\ndef DomeLight \"Sky\" { float inputs:intensity = " + (is_dark ? "0" : "1") + " }\n" +
           prims;
}

std::string with(const AttributeRow& row, const std::string& authored) {
    std::string text = row.stage;
    const size_t mark = text.find('$');
    if (mark == std::string::npos) return text;
    return text.replace(mark, 1, authored);
}

class SchemaAttributes : public testing::Test {
  protected:
    SchemaAttributes()
        : folder_(std::filesystem::temp_directory_path() /
                  fmt::format("velatura_attributes_{}", ::getpid())) {
        std::filesystem::create_directories(folder_);
        write_lamp(folder_.string());
    }

    ~SchemaAttributes() override { std::filesystem::remove_all(folder_); }

    std::optional<scene::Scene> scene_of(const std::string& prims, const AttributeRow& row) {
        const std::string file = (folder_ / "stage.usda").string();
        std::ofstream(file) << with_ends(whole(prims));
        Diagnostics diagnostics;
        auto stage = usd::stage::Stage::open(file, {}, diagnostics);
        if (!stage) {
            ADD_FAILURE() << stage.error().message << "\n" << whole(prims);
            return std::nullopt;
        }
        for (const Diagnostic& d : diagnostics.all())
            ADD_FAILURE() << diagnostics.format(d) << "\n" << whole(prims);
        translate::TranslateOptions options;
        options.time = 0.0;
        options.settings = row.settings;
        if (row.is_rendered) options.resolution = std::array<int, 2>{width, height};
        auto scene = translate::translate_stage(*stage, options, diagnostics);
        if (!scene) {
            ADD_FAILURE() << scene.error().message << "\n" << whole(prims);
            return std::nullopt;
        }
        return *std::move(scene);
    }

    std::vector<double> image_of(const std::string& prims, const AttributeRow& row) {
        const auto scene = scene_of(prims, row);
        if (!scene) return {};
        integrator::RenderOptions options;
        options.end_sample = 16;
        options.max_depth = 8;
        std::vector<double> sums = beauty(render_scene(*scene, options));
        for (double& sum : sums) sum /= double(options.end_sample);
        return sums;
    }

    /// Mean difference over the mean.
    static double difference(const std::vector<double>& a, const std::vector<double>& b) {
        if (a.size() != b.size()) return INFINITY;
        double sum = 0, total = 1e-12;
        for (size_t i = 0; i < a.size(); ++i) {
            sum += std::abs(a[i] - b[i]);
            total += std::abs(b[i]);
        }
        return sum / total;
    }

    void expect_image(const AttributeRow& row) {
        const std::vector<double> image = image_of(with(row, row.authored), row);
        const double change = difference(image_of(with(row, ""), row), image);
        const double tolerance = row.tolerance;
        EXPECT_GT(change, 3 * tolerance) << "no other image without it";
        if (!row.twin.empty()) {
            EXPECT_LT(difference(image, image_of(row.twin, row)), tolerance) << "not the twin's";
        }
        if (row.middle.empty()) return;
        for (size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (const size_t y : {5, 6})
                for (const size_t x : {7, 8}) sum += image[(y * width + x) * 3 + c] / 4;
            EXPECT_NEAR(sum, row.middle[c], std::max(row.middle[c], 0.1) * tolerance)
                << "channel " << c;
        }
    }

    void expect_number(const AttributeRow& row) {
        const auto authored = scene_of(with(row, row.authored), row),
                   plain = scene_of(with(row, ""), row);
        if (!authored || !plain) return;
        EXPECT_NEAR(row.read(*authored), row.value, 1e-6 * std::abs(row.value));
        EXPECT_GT(std::abs(row.read(*plain) - row.value), 1e-3);
    }

    std::filesystem::path folder_;
};

}  // namespace

std::string op(const std::string& kind, const std::string& value) {
    const bool is_matrix = kind == "transform", is_vector = value.starts_with('(');
    return fmt::format("{} xformOp:{} = {}\nuniform token[] xformOpOrder = [\"xformOp:{}\"]\n",
                       is_matrix   ? "matrix4d"
                       : is_vector ? "double3"
                                   : "double",
                       kind, value, kind);
}

std::string at(const std::string& position) {
    return op("translate", position);
}

std::vector<AttributeRow> attribute_rows(const std::string& folder) {
    std::vector<AttributeRow> rows;
    for (auto part : {geometry_rows(), skeleton_rows(), camera_rows(), light_rows(folder),
                      material_rows(), settings_rows()})
        rows.insert(rows.end(), part.begin(), part.end());
    return rows;
}

TEST_F(SchemaAttributes, EachAloneChangesTheImageAndHasItsTwin) {
    for (const AttributeRow& row : attribute_rows(folder_.string())) {
        SCOPED_TRACE(row.schema + "." + row.attribute);
        if (row.read) expect_number(row);
        if (row.is_rendered) expect_image(row);
    }
}

TEST_F(SchemaAttributes, EveryUsedOneHasARowAndNoOther) {
    std::set<std::pair<std::string, std::string>> used, shown, declared;
    for (const usd::stage::SchemaAttribute& a : usd::stage::schema_attributes()) {
        declared.emplace(a.schema, a.name);
        if (translate::support_of(a.schema, a.name) == translate::Support::Used)
            used.emplace(a.schema, a.name);
    }
    for (const AttributeRow& row : attribute_rows(folder_.string())) {
        EXPECT_TRUE(row.read || !row.twin.empty() || !row.middle.empty())
            << row.schema << "." << row.attribute << " is compared with nothing";
        shown.emplace(row.schema, row.attribute);
    }
    for (const auto& [schema, attribute] : used)
        EXPECT_TRUE(shown.contains({schema, attribute}))
            << schema << "." << attribute << " is used and not shown to work: add a row";
    for (const auto& [schema, attribute] : shown)
        EXPECT_TRUE(used.contains({schema, attribute}))
            << schema << "." << attribute << " is not used";
    for (const translate::UnusedAttribute& row : translate::unused_attributes())
        EXPECT_TRUE(declared.contains({std::string(row.schema), std::string(row.attribute)}))
            << row.schema << "." << row.attribute << " is declared by no schema";
}

}  // namespace velatura::test
