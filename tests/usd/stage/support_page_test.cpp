// SPDX-License-Identifier: Apache-2.0
// docs/reference/usd_support.md against the code: every format, arc, schema and attribute that the
// code's tables know has its row, and what a row promises can be found in the sources that keep it.
#include "usd/compose/layer_registry.h"
#include "usd/compose/prim_index.h"
#include "usd/stage/schema_tables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace velatura::usd::stage {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

struct Row {
    std::string status;
    Names used, warned, not_read;
};

std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string trimmed(const std::string& text) {
    const size_t first = text.find_first_not_of(' ');
    if (first == std::string::npos) return {};
    return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Everything in backquotes.
Names names_in(const std::string& cell) {
    Names names;
    for (size_t at = cell.find('`'); at != std::string::npos;) {
        const size_t end = cell.find('`', at + 1);
        if (end == std::string::npos) break;
        names.insert(cell.substr(at + 1, end - at - 1));
        at = cell.find('`', end + 1);
    }
    return names;
}

/// Rows of all tables of the page by their name.
std::map<std::string, Row> page_rows() {
    std::map<std::string, Row> rows;
    std::istringstream in(read(fs::path(VELATURA_SOURCE_DIR) / "docs/reference/usd_support.md"));
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with("| `")) continue;
        std::vector<std::string> cells;
        std::istringstream row(line.substr(1));
        for (std::string cell; std::getline(row, cell, '|');) cells.push_back(trimmed(cell));
        cells.resize(5);
        const Names name = names_in(cells[0]);
        EXPECT_EQ(name.size(), 1u) << line;
        EXPECT_TRUE(rows.count(*name.begin()) == 0) << *name.begin() << " has two rows";
        rows[*name.begin()] = {cells[1], names_in(cells[2]), names_in(cells[3]),
                               names_in(cells[4])};
    }
    return rows;
}

/// What the renderer asks the stage for: string literals of the sources that do.
Names literals() {
    std::vector<fs::path> files;
    const fs::path source = fs::path(VELATURA_SOURCE_DIR) / "src";
    for (const auto& entry : fs::recursive_directory_iterator(source / "translate")) {
        // A table of what is not done
        const bool is_asking = entry.path().filename() != "support_tables.cpp";
        if (entry.path().extension() == ".cpp" && is_asking) files.push_back(entry.path());
    }
    for (const char* view :
         {"xform", "imageable", "primvars", "material_binding", "collection", "skeleton"}) {
        files.push_back(source / "usd/stage" / (std::string(view) + ".cpp"));
    }
    files.push_back(source / "scene/scene.h");
    Names result;
    for (const fs::path& file : files) {
        const std::string text = read(file);
        for (size_t at = text.find('"'); at != std::string::npos;) {
            size_t end = at + 1;
            while (end < text.size() && text[end] != '"' && text[end] != '\n')
                end += text[end] == '\\' ? 2 : 1;
            if (end >= text.size()) break;
            if (text[end] == '"') result.insert(text.substr(at + 1, end - at - 1));
            at = text.find('"', end + 1);
        }
    }
    return result;
}

/// The sources ask for it, maybe without its namespace.
bool is_asked_for(const std::string& attribute, const Names& literals) {
    if (literals.count(attribute) != 0) return true;
    for (const std::string prefix : {"inputs:", "primvars:"}) {
        if (attribute.starts_with(prefix) && literals.count(attribute.substr(prefix.size())) != 0)
            return true;
    }
    // "collection:<name>:includeRoot" is put together
    return attribute.starts_with("collection:") &&
           literals.count(attribute.substr(attribute.rfind(':') + 1)) != 0;
}

TEST(SupportPage, HasARowForEveryFormatAndArc) {
    const auto rows = page_rows();
    for (const compose::LayerFormat& format : compose::layer_formats()) {
        const auto row = rows.find(std::string(format.name));
        ASSERT_NE(row, rows.end()) << format.name;
        EXPECT_EQ(row->second.status, format.read ? "yes" : "no") << format.name;
    }
    for (int arc = 1; arc <= int(compose::ArcType::Specialize); ++arc) {
        const char* name = compose::arc_name(compose::ArcType(arc));
        EXPECT_TRUE(rows.count(name) != 0) << name;
    }
}

TEST(SupportPage, HasARowForEverySchemaAndItsAttributes) {
    const auto rows = page_rows();
    std::map<std::string, Names> declared;
    for (const SchemaType& type : schema_types()) declared[std::string(type.name)];
    for (const SchemaAttribute& a : schema_attributes())
        declared[std::string(a.schema)].insert(std::string(a.name));
    for (const auto& [schema, attributes] : declared) {
        const auto row = rows.find(schema);
        if (row == rows.end()) {
            ADD_FAILURE() << schema << " has no row";
            continue;
        }
        Names listed = row->second.used;
        listed.insert(row->second.warned.begin(), row->second.warned.end());
        listed.insert(row->second.not_read.begin(), row->second.not_read.end());
        EXPECT_EQ(listed, attributes) << "attributes of " << schema;
        EXPECT_EQ(listed.size(),
                  row->second.used.size() + row->second.warned.size() + row->second.not_read.size())
            << schema << " lists a name twice";
    }
}

TEST(SupportPage, SaysWhatTheSourcesDo) {
    const auto rows = page_rows();
    const Names asked = literals();
    Names in_use;
    for (const auto& [name, row] : rows) {
        EXPECT_TRUE(Names({"yes", "warned", "no", "base"}).count(row.status) != 0) << name;
        in_use.insert(row.used.begin(), row.used.end());
        in_use.insert(row.warned.begin(), row.warned.end());
    }
    for (const SchemaAttribute& a : schema_attributes()) {
        const auto row = rows.find(std::string(a.schema));
        if (row == rows.end()) continue;
        const std::string name(a.name);
        if (row->second.warned.count(name) != 0)
            continue;  // tests/translate holds them to its table
        if (row->second.used.count(name) != 0) {
            EXPECT_TRUE(is_asked_for(name, asked))
                << a.schema << "." << name << " is not in the code";
        } else if (in_use.count(name) == 0) {
            // Names that another schema has too prove nothing
            EXPECT_FALSE(asked.count(name) != 0 && name.find(':') != std::string::npos)
                << a.schema << "." << name << " is in the code: say so on the page";
        }
    }
}

}  // namespace
}  // namespace velatura::usd::stage
