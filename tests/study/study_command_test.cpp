// SPDX-License-Identifier: Apache-2.0
// velatura study from the outside, on a scene of a few pixels.
#include "app/command.h"
#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <map>

namespace velatura::test {

namespace {

class StudyCommand : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", small_scene()); }

    CommandResult study(const std::string& arguments) const {
        return w.velatura("study s.usda -q --res 20 16 --spp 8 --rounds 3 --time 60s " + arguments);
    }

    nlohmann::json report(const std::string& folder) const {
        const Result<std::string> text = read_file(w.path(folder + "/report.json"));
        EXPECT_TRUE(text.has_value());
        return text ? nlohmann::json::parse(*text) : nlohmann::json();
    }

    static nlohmann::json setting(const nlohmann::json& report, const std::string& options) {
        for (const auto& s : report["settings"])
            if (s["options"] == options) return s;
        ADD_FAILURE() << "no setting " << options;
        return {};
    }

    Workplace w;
};

}  // namespace

TEST_F(StudyCommand, WritesAReportOfWhatTheSceneCallsFor) {
    const CommandResult r = study(
        "-o out --knobs sampler,max-depth,light-sampling,bvh-quality,light-selection --max-depth 2 "
        "--splitting off");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    EXPECT_TRUE(w.exists("out/report.html"));
    EXPECT_TRUE(w.exists("out/report.csv"));
    EXPECT_TRUE(w.exists("out/plot-all.png"));
    EXPECT_TRUE(w.exists("out/plot-max-bounces.png"));
    const nlohmann::json j = report("out");
    EXPECT_EQ(j["rounds"], 3);
    EXPECT_EQ(j["rows"].size(), 6u);
    EXPECT_GT(j["noise"]["value"], 0.0);
    // Cutting paths after two scatterings leaves light out, cutting after one leaves out more
    EXPECT_GT(j["bias"], 0.0);
    EXPECT_GT(setting(j, "--max-depth 1")["bias"], j["bias"]);
    EXPECT_EQ(setting(j, "--max-depth 0")["bias"], 0.0);
    EXPECT_LT(setting(j, "--max-depth 1")["rays_per_sample"],
              setting(j, "--max-depth 0")["rays_per_sample"]);
    EXPECT_EQ(setting(j, "--bvh-quality fast")["difference"]["same_picture"], true);
    for (const char* unbiased :
         {"--sampler independent", "--light-sampling light", "--light-sampling bsdf"})
        EXPECT_EQ(setting(j, unbiased)["difference"]["seen"], false) << unbiased;
    double energy = 0;
    for (const auto& l : j["layers"])
        if (l["by"] == "bounce") energy += l["energy"].get<double>();
    EXPECT_NEAR(energy, 1.0, 1e-6);
}

/// Beside the table: images in equal time, and what files take.
TEST_F(StudyCommand, ShowsImagesAndFiles) {
    const CommandResult r = study("-o out --knobs sampler,light-sampling");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    EXPECT_FALSE(w.exists("out/.file.exr"));
    const std::string html = read_file(w.path("out/report.html")).value();
    EXPECT_NE(html.find("<h2>At equal render time</h2>"), std::string::npos);
    const nlohmann::json files = report("out")["files"];
    ASSERT_EQ(files.size(), 10u);
    std::map<std::string, nlohmann::json> by_name;
    for (const auto& f : files) by_name[f["options"]] = f;
    EXPECT_EQ(by_name["half, zip"]["now"], true);
    EXPECT_LT(by_name["half, zip"]["bytes"], by_name["half, none"]["bytes"]);
    EXPECT_LT(by_name["half, none"]["bytes"], by_name["float, none"]["bytes"]);
    EXPECT_GT(by_name["half, zip"]["rounding"], 0.0);
    EXPECT_LT(by_name["half, zip"]["rounding"], 1e-3) << "a half rounds by 2^-11 at most";
    EXPECT_EQ(by_name["float, zip"]["rounding"], 0.0);
}

/// The height of arcs over chords falls with the square of the chord: by four a level.
TEST_F(StudyCommand, OutlinesOfSubdivisionSurfacesComeCloserByTheSquare) {
    if (!std::filesystem::exists(VELATURA_BIN_DIR
                                 "/../plugins/subdivision/velatura_subdivision.so"))
        GTEST_SKIP() << "built without the plugin subdivision";
    w.write("s.usda", small_scene() + R"usda(
def Mesh "Round"
{
    point3f[] points = [(-1, -1, -1), (1, -1, -1), (-1, 1, -1), (1, 1, -1), (-1, -1, 1), (1, -1,
        1), (-1, 1, 1), (1, 1, 1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3,
        7, 5]
    uniform token subdivisionScheme = "catmullClark"
}
)usda");
    ASSERT_EQ(study("-o out --knobs subdivision-level --subdivision-level 3").exit_code, 0);
    const nlohmann::json j = report("out");
    const double at_3 = setting(j, "")["outline_px"];
    EXPECT_GT(at_3, 0.0);
    EXPECT_NEAR(at_3 / setting(j, "--subdivision-level 5")["outline_px"].get<double>(), 16.0, 1.6);
    EXPECT_NEAR(at_3 / setting(j, "--subdivision-level 4")["outline_px"].get<double>(), 4.0, 0.6);
}

TEST_F(StudyCommand, GoesOnFromItsFolder) {
    const std::string knob = "--knobs sampler ";
    const std::string usual = "study s.usda -q --res 20 16 --spp 8 --time 60s " + knob;
    ASSERT_EQ(w.velatura(usual + "-o parts --rounds 2").exit_code, 0);
    ASSERT_EQ(w.velatura(usual + "-o parts --rounds 4 --resume").exit_code, 0);
    ASSERT_EQ(w.velatura(usual + "-o whole --rounds 4").exit_code, 0);
    const nlohmann::json parts = report("parts"), whole = report("whole");
    EXPECT_EQ(parts["rounds"], 4);
    EXPECT_EQ(parts["noise"], whole["noise"]);
    EXPECT_EQ(w.velatura(usual + "-o parts --rounds 4 --resume --max-depth 3").exit_code, 5);
    EXPECT_EQ(w.velatura(usual + "-o parts --rounds 4 --resume --seed 9").exit_code, 5);
    const CommandResult compared =
        w.velatura("study --compare parts/report.json whole/report.json");
    EXPECT_EQ(compared.exit_code, 0) << compared.output;
    EXPECT_NE(compared.output.find("--sampler independent"), std::string::npos);
}

/// The default roulette has a trial of its own: without it, it is that by throughput.
TEST_F(StudyCommand, LearnsWhatRendersLearn) {
    ASSERT_EQ(study("-o out --knobs roulette").exit_code, 0);
    const nlohmann::json j = report("out");
    EXPECT_NE(setting(j, "--roulette throughput")["rays_per_sample"],
              setting(j, "")["rays_per_sample"]);
}

/// Values that contradict other options are named with the reason; the study goes on.
TEST_F(StudyCommand, SaysWhatContradicts) {
    const CommandResult r = study(
        "-o out --light-sampling bsdf --light-selection power --knobs "
        "integrator,light-sampling,sampler,clamp-indirect");
    ASSERT_EQ(r.exit_code, 0);
    EXPECT_NE(r.output.find("\"clamp-indirect\" is skipped"), std::string::npos) << r.output;
    EXPECT_EQ(r.output.find("\"sampler\" is skipped"), std::string::npos) << r.output;
    const nlohmann::json j = report("out");
    EXPECT_EQ(setting(j, "--integrator whitted")["refused"],
              "--integrator whitted implies --light-sampling light, found bsdf");
    EXPECT_EQ(setting(j, "--light-sampling global-area")["refused"],
              "--light-sampling global-area implies --light-selection area, found power");
    EXPECT_EQ(setting(j, "--light-sampling area")["difference"]["seen"], false);
}

TEST_F(StudyCommand, SaysWhatItCannotDo) {
    EXPECT_EQ(w.velatura("study s.usda").exit_code, 2);
    EXPECT_EQ(w.velatura("study -o out").exit_code, 2);
    EXPECT_EQ(w.velatura("study s.usda --compare a.json b.json").exit_code, 2);
    EXPECT_EQ(w.velatura("study --compare a.json b.json").exit_code, 1);
    EXPECT_EQ(study("-o out --target-error 1%").exit_code, 2);
    EXPECT_EQ(study("-o out --deep").exit_code, 2);
    EXPECT_EQ(study("-o out --clamp-indirect 1").exit_code, 2);
    EXPECT_EQ(study("-o out --knobs nonsense").exit_code, 2);
    EXPECT_EQ(w.velatura("study missing.usda -o out").exit_code, 1);
}

TEST_F(StudyCommand, AnInterruptLeavesTheReport) {
    // It would go on for an hour. The signal comes once a third round has begun, five times in a
    // row: timeout(1) and farms send theirs to the process and to its group
    const std::string line =
        "cd '" + w.path("") +
        "' && ('" VELATURA_BIN_DIR
        "/velatura' study s.usda --res 20 16 --spp 8 --rounds 100000 --time 1h --knobs sampler "
        "--progress json -o out >log.txt 2>&1 & p=$!; for i in $(seq 6000); do grep -q "
        "'\"round\":[3-9]' log.txt && break; sleep 0.02; done; for i in 1 2 3 4 5; do kill -INT "
        "$p; done; wait $p)";
    const int status = std::system(line.c_str());
    const Result<std::string> log = read_file(w.path("log.txt"));
    EXPECT_EQ(WEXITSTATUS(status), 130) << *log;
    const Result<std::string> text = read_file(w.path("out/report.json"));
    ASSERT_TRUE(text.has_value()) << *log;
    EXPECT_GE(nlohmann::json::parse(*text)["rounds"].get<int>(), 2);
}

}  // namespace velatura::test
