// SPDX-License-Identifier: Apache-2.0
#include "support.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace velatura::translate {

size_t Translated::count(const std::string& code) const {
    size_t n = 0;
    for (const Diagnostic& d : diagnostics.all()) n += d.code == code;
    return n;
}

std::vector<float> Translated::inherited(size_t instance, const std::string& primvar) const {
    const scene::PrimvarId name = scene::find_primvar(scene, primvar);
    const scene::InstanceValue* value = scene::find_value(scene, scene.instances[instance], name);
    if (value == nullptr || name == scene::none) return {};
    return {value->values.begin(), value->values.begin() + value->width};
}

std::string Translated::messages(const std::string& code) const {
    std::string text;
    for (const Diagnostic& d : diagnostics.all())
        if (d.code == code) text += d.prim_path + ": " + d.message + "\n";
    return text;
}

void translate_text(const std::string& text, Translated& out, const TranslateOptions& options) {
    static std::atomic<int> counter{0};
    const auto file =
        std::filesystem::temp_directory_path() / ("velatura_translate_" + std::to_string(getpid()) +
                                                  "_" + std::to_string(counter++) + ".usda");
    std::ofstream(file) << (text.rfind("#", 0) == 0 ? text : "#usda 1.0\n" + text);
    auto stage = usd::stage::Stage::open(file.string(), {}, out.diagnostics);
    if (!stage) {
        out.error = stage.error().code;
        out.error_message = stage.error().message;
        for (const Diagnostic& d : out.diagnostics.all())
            out.error_message += "\n" + out.diagnostics.format(d);
    } else {
        auto scene = translate_stage(*stage, options, out.diagnostics);
        if (scene) {
            out.scene = *std::move(scene);
        } else {
            out.error = scene.error().code;
            out.error_message = scene.error().message;
        }
    }
    std::filesystem::remove(file);
}

std::string quad(const std::string& name, const std::string& extra) {
    return "def Mesh \"" + name + R"(" {
    point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0,1,2,3]
    uniform token subdivisionScheme = "none"
)" + extra +
           "\n}\n";
}

std::string camera(const std::string& extra) {
    return "def Camera \"Cam\" {\n" + extra + "\n}\n";
}

void translate_at(double time, const std::string& text, Translated& out) {
    TranslateOptions options;
    options.time = time;
    translate_text(text, out, options);
    ASSERT_EQ(out.error, "") << out.error_message;
}

Vec3 position(const Mat4& m) {
    return {m[3][0], m[3][1], m[3][2]};
}

const Mat4& key(const scene::Instance& instance, size_t k) {
    return k == 0 ? instance.render_from_prototype : instance.later_render_from_prototype[k - 1];
}

}  // namespace velatura::translate
