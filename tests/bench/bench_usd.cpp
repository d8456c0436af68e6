// SPDX-License-Identifier: Apache-2.0
// Speed and memory of reading USD, beside the size of the input. Usage: velatura_bench_usd [SCENE]
#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "usd/crate/reader.h"
#include "usd/crate/writer.h"
#include "usd/stage/stage.h"
#include "usd/text/reader.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace velatura::bench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return double(now.tv_sec) + double(now.tv_nsec) * 1e-9;
}

/// Bytes of this process that are in memory, freed ones returned to the system first.
double resident_bytes() {
    malloc_trim(0);
    std::ifstream statm("/proc/self/statm");
    double total = 0, resident = 0;
    statm >> total >> resident;
    return resident * double(sysconf(_SC_PAGESIZE));
}

/// Numbers that repeat from run to run; quality does not matter.
class Numbers {
  public:
    double next() {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return double(state_ >> 11) * 0x1p-53;
    }

  private:
    uint64_t state_ = 1;
};

std::string mesh_text(size_t points) {
    Numbers numbers;
    std::string text = "#usda 1.0\ndef Mesh \"M\"\n{\n    point3f[] points = [";
    for (size_t i = 0; i < points; ++i) {
        const auto coordinate = [&] { return float(numbers.next() * 200.0 - 100.0); };
        text +=
            fmt::format("{}({}, {}, {})", i ? ", " : "", coordinate(), coordinate(), coordinate());
    }
    text += "]\n    int[] faceVertexIndices = [";
    for (size_t i = 0; i < points * 2; ++i)
        text += fmt::format("{}{}", i ? ", " : "", uint64_t(numbers.next() * double(points)));
    return text + "]\n}\n";
}

/// groups × children prims below one root; `body` is what each of them says.
std::string prims_text(const std::string& head,
                       size_t groups,
                       size_t children,
                       const std::string& metadata,
                       const std::string& body) {
    std::string text = head + "def Xform \"World\"\n{\n";
    for (size_t g = 0; g < groups; ++g) {
        text += fmt::format("    def Xform \"Group_{}\"\n    {{\n", g);
        for (size_t c = 0; c < children; ++c) {
            text += fmt::format(
                "        def Xform \"Prim_{}\"{}\n        {{\n{}            double3 "
                "xformOp:translate = ({}, {}, 0)\n"
                "            uniform token[] xformOpOrder = [\"xformOp:translate\"]\n        }}\n",
                c, metadata, body, c, g);
        }
        text += "    }\n";
    }
    return text + "}\n";
}

class TemporaryFolder {
  public:
    TemporaryFolder()
        : path_(fs::temp_directory_path() / fmt::format("velatura_bench_usd_{}", getpid())) {
        fs::create_directories(path_);
    }

    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    ~TemporaryFolder() { fs::remove_all(path_); }

    std::string write(const std::string& name, const std::string& content) const {
        const std::string file = (path_ / name).string();
        std::ofstream(file, std::ios::binary) << content;
        return file;
    }

  private:
    fs::path path_;
};

void measure_text(const std::string& what, const std::string& text) {
    double best = 1e30;
    for (int round = 0; round < 3; ++round) {
        Diagnostics diagnostics;
        const double start = thread_seconds();
        const auto layer = usd::text::read_text_layer(text, "bench.usda", diagnostics);
        if (!layer) fmt::print("  {}\n", layer.error().message);
        best = std::min(best, thread_seconds() - start);
    }
    const double megabytes = double(text.size()) * 1e-6;
    fmt::print("  {:34} {:8.1f} MB {:8.3f} s {:8.1f} MB/s\n", what, megabytes, best,
               megabytes / best);
}

/// Writes the text's layer as a crate and opens it again: the structure is read, arrays wait.
void measure_crate(const std::string& what,
                   const std::string& text,
                   const TemporaryFolder& folder) {
    Diagnostics diagnostics;
    const auto layer = usd::text::read_text_layer(text, "bench.usda", diagnostics);
    if (!layer) return;
    const auto bytes = usd::crate::write_crate_layer(**layer, diagnostics);
    if (!bytes) return;
    const std::string file = folder.write("bench.usdc", *bytes);
    double best = 1e30;
    size_t specs = 0;
    for (int round = 0; round < 3; ++round) {
        const double start = thread_seconds();
        const auto asset = open_asset_bytes(file);
        const auto crate = usd::crate::read_crate_layer(*asset, file, diagnostics);
        if (!crate) return;
        best = std::min(best, thread_seconds() - start);
        specs = (*crate)->spec_count();
    }
    fmt::print("  {:34} {:8.1f} MB {:8.4f} s {:9} specs, {:.2f} Mspecs/s; text {:.1f} MB\n", what,
               double(bytes->size()) * 1e-6, best, specs, double(specs) / best * 1e-6,
               double(text.size()) * 1e-6);
}

size_t count_prims(const usd::stage::Stage& stage) {
    size_t count = 0;
    usd::stage::traverse(stage.pseudo_root(), [&](usd::stage::Prim prim) {
        ++count;
        return !prim.is_instance();
    });
    return count;
}

void open_and_visit(const std::string& what, const std::string& file) {
    const double before = resident_bytes();
    Diagnostics diagnostics;
    const auto start = Clock::now();
    const auto stage = usd::stage::Stage::open(file, {}, diagnostics);
    if (!stage) {
        fmt::print("  {}\n", stage.error().message);
        return;
    }
    const size_t visited = count_prims(*stage);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    const double bytes = resident_bytes() - before;
    fmt::print(
        "  {:34} {:8.1f} MB {:8.3f} s {:9} prims {:9} composed {:7.0f} bytes/prim, {:.0f} MB\n",
        what, double(fs::file_size(file)) * 1e-6, seconds, visited, stage->prim_count(),
        bytes / double(visited), bytes * 1e-6);
}

/// In a process of its own: memory that an earlier stage has left behind would hide the growth.
void measure_stage(const std::string& what, const std::string& file) {
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        open_and_visit(what, file);
        std::fflush(stdout);
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (status != 0) fmt::print("  {}: stopped with status {}\n", what, status);
}

int run() {
    fmt::print("text to layer, one thread, CPU time, best of 3\n");
    measure_text("points and indices of a mesh", mesh_text(2'000'000));
    measure_text("200,000 small prims", prims_text("#usda 1.0\n", 100, 2000, "", ""));

    const TemporaryFolder folder;
    const std::string asset = folder.write(
        "asset.usda", "#usda 1.0\n(\n    defaultPrim = \"A\"\n)\ndef Xform \"A\"\n{\n" + [] {
            std::string children;
            for (int i = 0; i < 9; ++i)
                children += fmt::format(
                    "    def Sphere \"S{}\"\n    {{\n        double radius = {}\n    }}\n", i,
                    i + 1);
            return children;
        }() + "}\n");
    fmt::print(
        "crate to layer, one thread, CPU time, best of 3; arrays stay in the file until used\n");
    measure_crate("points and indices of a mesh", mesh_text(2'000'000), folder);
    measure_crate("200,000 small prims", prims_text("#usda 1.0\n", 100, 2000, "", ""), folder);

    fmt::print("file to stage, every prim visited\n");
    measure_stage("1,000,000 prims in one layer",
                  folder.write("flat.usda", prims_text("#usda 1.0\n", 1000, 1000, "", "")));
    measure_stage(
        "100,000 references to 10 prims",
        folder.write("refs.usda",
                     prims_text("#usda 1.0\n", 100, 1000,
                                " (\n            references = @asset.usda@\n        )", "")));
    measure_stage("100,000 instances of 10 prims",
                  folder.write("inst.usda", prims_text("#usda 1.0\n", 100, 1000,
                                                       " (\n            instanceable = true\n      "
                                                       "      references = @asset.usda@\n        )",
                                                       "")));
    return 0;
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    if (argc > 1 && std::filesystem::exists(argv[1])) {
        velatura::bench::measure_stage(std::filesystem::path(argv[1]).filename().string(), argv[1]);
        return 0;
    }
    return velatura::bench::run();
}
