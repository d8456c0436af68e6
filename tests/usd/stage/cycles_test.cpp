// SPDX-License-Identifier: Apache-2.0
// Arcs that lead back to where they come from, by every kind of arc and through every kind of file:
// each graph is refused with the arc's place, at once, and the rest of the stage lives.
#include "stage_fixture.h"
#include "stored_zip.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <vector>

namespace velatura::usd::stage {

namespace {

using Files = std::map<std::string, std::string>;

struct Graph {
    std::string name;
    Files files;  ///< one is root.usda
};

enum class Arc {
    Reference,
    Payload,
    Inherit,
    Specialize,
    Variant,
    FileReference,
    FilePayload,
    Package,
    Count
};

constexpr std::string_view arc_names[] = {"reference",         "payload", "inherit",
                                          "specialize",        "variant", "reference of a file",
                                          "payload of a file", "package"};
static_assert(std::size(arc_names) == size_t(Arc::Count));

bool is_of_file(Arc arc) {
    return arc == Arc::FileReference || arc == Arc::FilePayload || arc == Arc::Package;
}

/// Prim `from` with an arc to prim `to`, which may lie in the file `file`. Braces are spread over
/// lines when written.
std::string prim(Arc arc,
                 const std::string& from,
                 const std::string& to,
                 const std::string& file,
                 bool is_instance) {
    const std::string flag = is_instance ? "instanceable = true\n" : "";
    const auto with = [&](const std::string& metadata, const std::string& body) {
        return fmt::format("def Xform \"{}\" (\n{}{}\n) {{{}}}\n", from, flag, metadata, body);
    };
    switch (arc) {
        case Arc::Reference:
            return with(fmt::format("references = <{}>", to), "def Sphere \"s\" {}");
        case Arc::Payload:
            return with(fmt::format("payload = <{}>", to), "def Sphere \"s\" {}");
        case Arc::Inherit:
            return with(fmt::format("inherits = <{}>", to), "def Sphere \"s\" {}");
        case Arc::Specialize:
            return with(fmt::format("specializes = <{}>", to), "def Sphere \"s\" {}");
        case Arc::Variant:
            return with(
                "variants = {string v = \"x\"}\nprepend variantSets = \"v\"",
                fmt::format("variantSet \"v\" = {{\"x\" (\nreferences = <{}>\n) {{}}}}", to));
        case Arc::FileReference:
        case Arc::Package:
            return with(fmt::format("references = @{}@<{}>", file, to), "def Sphere \"s\" {}");
        case Arc::FilePayload:
            return with(fmt::format("payload = @{}@<{}>", file, to), "def Sphere \"s\" {}");
        case Arc::Count:
            break;
    }
    return {};
}

/// Prims P0 … of one file each, or all in root.usda, the arc of each leading to the next and that
/// of the last to P0.
Graph ring(const std::string& name, const std::vector<Arc>& arcs, bool is_instance) {
    Graph graph{name, {}};
    std::string file = "root.usda";
    const auto file_of = [&](size_t i) {
        return i == 0 ? std::string("root.usda")
                      : fmt::format("f{}.{}", i, arcs[i - 1] == Arc::Package ? "usdz" : "usda");
    };
    for (size_t i = 0; i < arcs.size(); ++i) {
        const size_t next = (i + 1) % arcs.size();
        const std::string target = is_of_file(arcs[i]) ? file_of(next) : file;
        // The way back to P0 from another file is by that file
        const bool comes_home = next == 0 && file != "root.usda" && !is_of_file(arcs[i]);
        const Arc arc = comes_home ? Arc::FileReference : arcs[i];
        graph.files[file] += prim(arc, fmt::format("P{}", i), fmt::format("/P{}", next),
                                  comes_home ? "root.usda" : target, is_instance);
        if (is_of_file(arcs[i])) file = target;
    }
    return graph;
}

/// A prim below another with an arc to what holds it, directly or over the children of others: a
/// namespace without end.
Graph nest(Arc arc, size_t length, bool is_instance) {
    Graph graph{
        fmt::format("{} {}s into {} another{}", length, arc_names[size_t(arc)],
                    length == 1 ? "what holds" : "one", is_instance ? ", as instances" : ""),
        {}};
    for (size_t i = 0; i < length; ++i)
        graph.files["root.usda"] +=
            fmt::format("def Xform \"P{}\" {{\n{}}}\n", i,
                        prim(arc, "c", fmt::format("/P{}", (i + 1) % length), "", is_instance));
    return graph;
}

/// Layers each of which has the next as its sublayer, the last one the first.
Graph sub_layers(size_t length) {
    Graph graph{fmt::format("{} sublayers", length), {}};
    const auto file_of = [](size_t i) {
        return i == 0 ? std::string("root.usda") : fmt::format("f{}.usda", i);
    };
    for (size_t i = 0; i < length; ++i)
        graph.files[file_of(i)] = fmt::format(
            "(\nsubLayers = [@./{}@]\n)\ndef Sphere \"S{}\" {{}}\n", file_of((i + 1) % length), i);
    return graph;
}

std::vector<Graph> graphs() {
    std::vector<Graph> all;
    for (size_t kind = 0; kind < size_t(Arc::Count); ++kind) {
        for (const size_t length : {size_t(1), size_t(2), size_t(5)}) {
            // A package cannot lead back to a file beside it but by its name
            if (Arc(kind) == Arc::Package && length == 1) continue;
            all.push_back(ring(fmt::format("{} of {}", length, arc_names[kind]),
                               std::vector<Arc>(length, Arc(kind)), false));
        }
    }
    for (size_t i = 0; i < 12; ++i) {
        std::vector<Arc> arcs;
        for (size_t k = 0; k < 3 + i % 4; ++k)
            arcs.push_back(Arc((i * 5 + k * (1 + i % 7)) % size_t(Arc::Count)));
        all.push_back(ring(fmt::format("mixed {}", i), arcs, i % 2 == 1));
    }
    for (const Arc arc :
         {Arc::Reference, Arc::Payload, Arc::Inherit, Arc::Specialize, Arc::Variant}) {
        all.push_back(nest(arc, 1, false));
        all.push_back(nest(arc, 2, false));
        all.push_back(nest(arc, 2, true));
    }
    for (const size_t length : {size_t(1), size_t(2), size_t(3), size_t(40)})
        all.push_back(sub_layers(length));
    return all;
}

class CyclesTest : public StageTest {
  protected:
    void write_graph(const Graph& graph) {
        for (const auto& [name, body] : graph.files) {
            const std::string text = "#usda 1.0\n" + spread(body);
            const bool is_package = name.ends_with(".usdz");
            std::ofstream(folder_ / name, std::ios::binary)
                << (is_package ? testing::stored_zip({{"layer.usda", text}}) : text);
        }
    }
};

}  // namespace

TEST_F(CyclesTest, FiftyGraphsAreRefusedAtOnce) {
    const std::vector<Graph> all = graphs();
    EXPECT_GE(all.size(), 50u);
    double slowest = 0;
    for (const Graph& graph : all) {
        SCOPED_TRACE(graph.name);
        for (const auto& entry : std::filesystem::directory_iterator(folder_))
            std::filesystem::remove(entry.path());
        write_graph(graph);
        Diagnostics diagnostics;
        const auto start = std::chrono::steady_clock::now();
        const auto stage = Stage::open((folder_ / "root.usda").string(), {}, diagnostics);
        ASSERT_TRUE(stage.has_value());
        // Through instances too, where prims are composed when they are asked for
        size_t prims = 0;
        traverse(stage->pseudo_root(), [&](Prim) { return ++prims < 100'000; });
        slowest = std::max(
            slowest,
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        EXPECT_LT(prims, 10'000u);
        const std::vector<Diagnostic> said = diagnostics.all();
        const auto cycle = std::find_if(said.begin(), said.end(), [](const Diagnostic& d) {
            return d.code == "usd-arc-cycle" || d.code == "usd-sublayer-cycle";
        });
        ASSERT_NE(cycle, said.end())
            << (said.empty() ? "nothing is said" : diagnostics.format(said.front()));
        EXPECT_EQ(cycle->severity, Severity::Error);
        EXPECT_GT(cycle->loc.line, 0u) << diagnostics.format(*cycle);
    }
    RecordProperty("slowest_seconds", fmt::format("{:.3f}", slowest));
}

}  // namespace velatura::usd::stage
