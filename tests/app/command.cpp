// SPDX-License-Identifier: Apache-2.0
#include "command.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace velatura::test {

namespace fs = std::filesystem;

Workplace::Workplace() {
    std::string pattern = (fs::temp_directory_path() / "velatura_app_XXXXXX").string();
    if (!::mkdtemp(pattern.data())) throw std::runtime_error("cannot make a folder for the test");
    folder_ = pattern;
}

Workplace::~Workplace() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

CommandResult Workplace::run(const std::string& program, const std::string& arguments) const {
    const std::string line =
        fmt::format("cd '{}' && '{}/{}' {} 2>&1", folder_, VELATURA_BIN_DIR, program, arguments);
    CommandResult result;
    FILE* pipe = ::popen(line.c_str(), "r");
    if (!pipe) return result;
    std::array<char, 4096> buffer{};
    while (const size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
        result.output.append(buffer.data(), n);
    const int status = ::pclose(pipe);
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
}

void Workplace::write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name)) << content;
}

bool Workplace::exists(const std::string& name) const {
    return fs::exists(path(name));
}

std::string Workplace::files_beside(const std::string& known) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
        const std::string name = entry.path().filename().string();
        if ((" " + known + " ").find(" " + name + " ") == std::string::npos) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return fmt::format("{}", fmt::join(names, " "));
}

std::string Workplace::hash(const std::string& exr) const {
    const CommandResult r = comp("info --hash " + exr);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    const size_t begin = r.output.find_first_of("0123456789abcdef");
    return begin == std::string::npos ? "" : r.output.substr(begin, 64);
}

std::string textured_ball(const std::string& file) {
    return R"usda(def Sphere "S" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    rel material:binding = </M>
}
def Material "M"
{
    token outputs:surface.connect = </M/P.outputs:surface>
    def Shader "P"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>
        token outputs:surface
    }
    def Shader "T"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @)usda" +
           file + R"usda(@
        token inputs:wrapS = "repeat"
        token inputs:wrapT = "repeat"
        float3 outputs:rgb
    }
}
)usda";
}

bool copy_made_scene(const Workplace& w, const std::string& name) {
    const fs::path scenes = w.path("scenes"), source = fs::path(VELATURA_SOURCE_DIR) / "scenes";
    fs::create_directory(scenes);
    for (const std::string& part : {name, std::string("tools")})
        fs::copy(source / part, scenes / part, fs::copy_options::recursive);
    fs::copy(source / "make.py", scenes / "make.py");
    const fs::path complete = scenes / name / "generated" / "complete";
    if (!fs::exists(scenes / name / "generate.py") || fs::exists(complete)) return true;
    const std::string line = fmt::format("/usr/bin/python3 '{}' {} >/dev/null 2>&1",
                                         (scenes / "make.py").string(), name);
    if (std::system(line.c_str()) != 0) throw std::runtime_error(line + " failed");
    // make.py leaves out what it has no library for
    return fs::exists(complete);
}

std::string small_scene() {
    return R"usda(#usda 1.0
(
    defaultPrim = "W"
    upAxis = "Y"
)
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 20
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 1, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Corner"
    {
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 5, 4]
        point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -2), (-3, 0, -2), (-3, 4, -2), (3, 4, -2)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.7, 0.6, 0.5)]
    }
    def Sphere "Ball"
    {
        double radius = 0.6
        double3 xformOp:translate = (0, 0.6, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def RectLight "key"
    {
        float inputs:intensity = 8
        double3 xformOp:translate = (2, 2.5, 2)
        float xformOp:rotateX = -50
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }
    def SphereLight "lamp"
    {
        float inputs:intensity = 10
        float inputs:radius = 0.2
        double3 xformOp:translate = (-1.5, 1.5, 0.5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "sky"
    {
        float inputs:intensity = 0.2
    }
}
)usda";
}

}  // namespace velatura::test
