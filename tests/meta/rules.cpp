// SPDX-License-Identifier: Apache-2.0
#include "meta/rules.h"

#include "meta/house.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace velatura::meta {

namespace {

namespace fs = std::filesystem;

struct Include {
    std::string header;
    bool is_quoted = false;
    size_t line = 0;  // from 1
};

std::vector<Include> includes_of(const SourceFile& file) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*(["<])([^">]+)[">])re");
    std::vector<Include> found;
    std::smatch match;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        if (std::regex_search(file.lines[i], match, pattern)) {
            found.push_back({match[2], match[1] == "\"", i + 1});
        }
    }
    return found;
}

std::string violation(const SourceFile& file, size_t line, const std::string& what) {
    return file.path + ":" + std::to_string(line) + ": " + what;
}

std::vector<std::string> lines_matching(const SourceFile& file,
                                        const std::regex& pattern,
                                        const std::string& what) {
    std::vector<std::string> out;
    std::smatch match;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        if (std::regex_search(file.lines[i], match, pattern)) {
            out.push_back(violation(file, i + 1, what + ": " + match.str()));
        }
    }
    return out;
}

std::string parent_folder(const std::string& path) {
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? std::string() : path.substr(0, slash);
}

std::string base_name(const std::string& path) {
    return path.substr(path.rfind('/') + 1);
}

// The tier whose header this is, as written after #include
std::string tier_of_header(const std::string& header) {
    return header.starts_with("compositor/") ? tier_of(header) : tier_of("src/" + header);
}

std::string namespace_of_tier(const std::string& tier) {
    if (tier == "base") return "velatura";
    // A room of base is a namespace of base's, which is velatura
    const std::string base = "base/";
    std::string name = "velatura::" + (tier.starts_with(base) ? tier.substr(base.size()) : tier);
    for (size_t slash = name.find('/'); slash != std::string::npos; slash = name.find('/'))
        name.replace(slash, 1, "::");
    return name;
}

bool can_include(const std::string& tier, const std::string& other) {
    // All tiers include base, but for those that base itself includes
    const bool is_below_base = tier_table().at("base").contains(tier);
    return other == tier || (other == "base" && !is_below_base) ||
           tier_table().at(tier).contains(other);
}

bool is_command_line_file(const SourceFile& file) {
    return file.is_below("src/app/") || file.is_below("compositor/cli/") ||
           file.path == "compositor/window/main.cpp" || file.path == "src/view/main.cpp";
}

}  // namespace

bool SourceFile::ends_with(const std::string& suffix) const {
    return path.ends_with(suffix);
}

bool SourceFile::is_below(const std::string& folder) const {
    return path.starts_with(folder);
}

bool SourceFile::is_cpp_or_header() const {
    return path.ends_with(".cpp") || path.ends_with(".h");
}

SourceFile make_file(std::string path, const std::string& text) {
    SourceFile file{std::move(path), {}};
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) file.lines.push_back(line);
    return file;
}

std::vector<SourceFile> read_tree(const std::string& root) {
    static const std::set<std::string> kept = {
        "src",           "compositor",  "plugins",         "tests",
        "scenes",        "docs",        "examples",        ".ci",
        "dev",           "README.md",   "CONTRIBUTING.md", "CHANGELOG.md",
        "SECURITY.md",   "NOTICE",      "CMakeLists.txt",  "CMakePresets.json",
        ".github",       ".clangd",     ".editorconfig",   ".git-blame-ignore-revs",
        ".clang-format", ".clang-tidy", ".gitignore"};
    static const std::set<std::string> text = {".h",    ".cpp", ".inl", ".cmake", ".txt",
                                               ".md",   ".py",  ".sh",  ".usda",  ".toml",
                                               ".json", ".yml", ""};
    std::vector<SourceFile> files;
    const auto add = [&](const fs::path& path) {
        if (!fs::is_regular_file(path) || !text.contains(path.extension().string())) return;
        std::ifstream stream(path);
        std::stringstream content;
        content << stream.rdbuf();
        files.push_back(make_file(fs::relative(path, root).generic_string(), content.str()));
    };
    for (const fs::directory_entry& entry : fs::directory_iterator(root)) {
        if (!kept.contains(entry.path().filename().string())) continue;
        add(entry.path());
        if (!entry.is_directory()) continue;
        for (auto it = fs::recursive_directory_iterator(entry.path());
             it != fs::recursive_directory_iterator(); ++it) {
            // What generators of scenes make is not part of the project
            if (entry.path().filename() == "scenes" && it->is_directory() &&
                it->path().filename() == "generated")
                it.disable_recursion_pending();
            add(it->path());
        }
    }
    std::sort(files.begin(), files.end(),
              [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
    return files;
}

std::string tier_of(const std::string& path) {
    const bool is_compositor = path.starts_with("compositor/");
    if (!is_compositor && !path.starts_with("src/")) return {};
    for (std::string folder = parent_folder(is_compositor ? path : path.substr(4)); !folder.empty();
         folder = parent_folder(folder)) {
        if (tier_table().contains(folder)) return folder;
    }
    return {};
}

std::vector<std::string> check_tier_includes(const SourceFile& file) {
    if (!file.is_cpp_or_header() || !(file.is_below("src/") || file.is_below("compositor/")))
        return {};
    const std::string tier = tier_of(file.path);
    if (tier.empty()) return {violation(file, 1, "lies in no tier of the table")};
    std::vector<std::string> out;
    for (const Include& include : includes_of(file)) {
        if (!include.is_quoted) continue;
        const std::string other = tier_of_header(include.header);
        if (other.empty()) {
            out.push_back(
                violation(file, include.line, "\"" + include.header + "\" names no tier"));
        } else if (!can_include(tier, other)) {
            out.push_back(
                violation(file, include.line,
                          tier + " must not include " + other + " (\"" + include.header + "\")"));
        }
    }
    return out;
}

std::vector<std::string> check_libraries(const SourceFile& file) {
    const bool is_ours =
        file.is_below("src/") || file.is_below("compositor/") || file.is_below("plugins/");
    if (!file.is_cpp_or_header() || !is_ours) return {};
    std::vector<std::string> out;
    for (const Include& include : includes_of(file)) {
        if (include.is_quoted || is_system_header(include.header)) continue;
        const auto& table = library_table();
        const auto library = std::find_if(table.begin(), table.end(), [&](const Library& l) {
            return include.header.starts_with(l.header_prefix);
        });
        if (library == table.end()) {
            out.push_back(violation(file, include.line,
                                    "<" + include.header + "> belongs to no library of the table"));
            continue;
        }
        const bool allowed =
            library->allowed.empty() ||
            std::any_of(library->allowed.begin(), library->allowed.end(),
                        [&](std::string_view prefix) { return file.path.starts_with(prefix); });
        if (!allowed)
            out.push_back(
                violation(file, include.line, "<" + include.header + "> is not allowed here"));
    }
    return out;
}

std::vector<std::string> check_file_size(const SourceFile& file) {
    if (!file.is_cpp_or_header() || file.ends_with("_tables.cpp")) return {};
    const size_t limit = file.ends_with(".h") ? 400 : 800;
    if (file.lines.size() <= limit) return {};
    return {violation(file, file.lines.size(), "more than " + std::to_string(limit) + " lines")};
}

std::vector<std::string> check_line_length(const SourceFile& file) {
    constexpr size_t limit = 100;
    if (!file.is_cpp_or_header() || file.path.find("/generated/") != std::string::npos) return {};
    std::vector<std::string> out;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        // A byte 10xxxxxx goes on with the character before it
        const auto length = std::count_if(file.lines[i].begin(), file.lines[i].end(),
                                          [](char c) { return (c & 0xC0) != 0x80; });
        if (size_t(length) > limit)
            out.push_back(
                violation(file, i + 1, "more than " + std::to_string(limit) + " columns"));
    }
    return out;
}

std::vector<std::string> check_spdx(const SourceFile& file) {
    const std::string words = "SPDX-License-Identifier: Apache-2.0";
    std::string mark;
    if (file.is_cpp_or_header()) mark = "// ";
    if (file.ends_with("CMakeLists.txt") || file.ends_with(".cmake") || file.ends_with(".py") ||
        file.ends_with(".sh") || file.path == "dev" || file.path == ".ci/run") {
        mark = "# ";
    }
    if (mark.empty()) return {};
    // A script's first line is its interpreter
    const size_t index = !file.lines.empty() && file.lines[0].starts_with("#!") ? 1 : 0;
    if (index < file.lines.size() && file.lines[index] == mark + words) return {};
    return {violation(file, index + 1, "the SPDX line is missing")};
}

std::vector<std::string> check_namespace(const SourceFile& file) {
    const std::string tier = tier_of(file.path);
    if (!file.is_cpp_or_header() || tier.empty()) return {};
    static const std::regex pattern(R"(^\s*namespace\s+(velatura(::\w+)*)\s*\{)");
    static const std::regex inline_pattern(R"(^inline namespace (\w+) \{)");
    const std::string expected = namespace_of_tier(tier);
    std::vector<std::string> out;
    bool has_own = false;
    std::smatch match;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        if (!std::regex_search(file.lines[i], match, pattern)) continue;
        std::string name = match[1].str();
        // The names of an inline namespace are those of the tier around it, too
        std::smatch within;
        if (i + 1 < file.lines.size() &&
            std::regex_search(file.lines[i + 1], within, inline_pattern))
            name += "::" + within[1].str();
        const bool is_own =
            name == expected || (tier != "base" && name.starts_with(expected + "::"));
        has_own = has_own || is_own;
        // Forward declarations and hooks of a tier that may be included are fine
        const bool is_known =
            std::any_of(tier_table().begin(), tier_table().end(), [&](const auto& row) {
                return namespace_of_tier(row.first) == name && can_include(tier, row.first);
            });
        if (!is_own && !is_known)
            out.push_back(
                violation(file, i + 1, "namespace " + name + " in the folder of " + expected));
    }
    if (file.ends_with(".h") && !has_own)
        out.push_back(violation(file, 1, "opens no namespace " + expected));
    return out;
}

std::vector<std::string> check_pragma_once(const SourceFile& file) {
    if (!file.ends_with(".h")) return {};
    if (std::find(file.lines.begin(), file.lines.end(), "#pragma once") != file.lines.end())
        return {};
    return {violation(file, 1, "#pragma once is missing")};
}

std::vector<std::string> check_own_header_first(const SourceFile& file,
                                                const std::vector<SourceFile>& tree) {
    if (!file.ends_with(".cpp") || file.is_below("tests/")) return {};
    std::string header = file.path.substr(0, file.path.size() - 4) + ".h";
    const bool exists = std::any_of(tree.begin(), tree.end(),
                                    [&](const SourceFile& f) { return f.path == header; });
    if (!exists) return {};
    if (header.starts_with("src/")) header = header.substr(4);
    const std::vector<Include> includes = includes_of(file);
    if (!includes.empty() && includes[0].is_quoted && includes[0].header == header) return {};
    return {violation(file, includes.empty() ? 1 : includes[0].line,
                      "the first include must be \"" + header + "\"")};
}

std::vector<std::string> check_machine_paths(const SourceFile& file) {
    // Written in pieces, so that this file does not find itself
    static const std::regex pattern(std::string(R"((^|[\s"'(=:@]))") + "/(" + "home|" + "work|" +
                                    "root|" + "Users" + R"()/\w+)");
    return lines_matching(file, pattern, "path of one machine");
}

std::vector<std::string> check_banned_words(const SourceFile& file) {
    if (!file.is_cpp_or_header() || file.is_below("tests/meta/")) return {};
    static const std::regex pattern(
        R"(\b(TODO|FIXME|XXX|HACK)\b|^\s*#\s*if\s+0\b|std::format\(|std::expected<)"
        R"(|<source_location>|\bviews::|\bDISABLED_\w|-ffast-math|using namespace std\b)");
    return lines_matching(file, pattern, "not in this house");
}

std::vector<std::string> check_silence(const SourceFile& file) {
    const bool is_library =
        file.is_below("src/") || file.is_below("compositor/") || file.is_below("plugins/");
    if (!file.is_cpp_or_header() || !is_library || is_command_line_file(file)) return {};
    if (file.path == "src/base/check.cpp") return {};
    static const std::regex pattern(
        R"(std::(cout|cerr|clog)\b|fmt::print\b|\b(std::)?(f?printf|puts|perror)\s*\()");
    return lines_matching(file, pattern, "libraries never print");
}

std::vector<std::string> check_one_renderer(const SourceFile& file) {
    static const std::regex assembles(
        R"((train_guide|try_roulette|try_bounces|try_splitting|make_caustic_sampler)\s*\(|)"
        R"(integrator::(World|PathTracer)\s+\w+\s*[({]|)"
        R"(make_(unique|shared)<(const )?integrator::(World|PathTracer)>)");
    // Tests look at the parts one by one
    if (!file.is_cpp_or_header() || file.is_below("src/integrator/") ||
        file.is_below("src/render/") || file.is_below("tests/"))
        return {};
    return lines_matching(file, assembles, "only src/render puts renderers together");
}

std::vector<std::string> check_test_is_real(const SourceFile& file) {
    if (!file.is_below("tests/") || file.is_below("tests/meta/") || !file.ends_with(".cpp"))
        return {};
    static const std::regex pattern(R"((EXPECT|ASSERT)_TRUE\(\s*true\s*\)|\bSUCCEED\(\)|)"
                                    R"((EXPECT|ASSERT)_EQ\(\s*(\w+)\s*,\s*\3\s*\))");
    return lines_matching(file, pattern, "an assertion that cannot fail");
}

std::vector<std::string> check_test_assets(const SourceFile& file) {
    if (!file.is_cpp_or_header() || file.path == "tests/base/test_assets.h" ||
        file.is_below("tests/meta/"))
        return {};
    static const std::regex pattern(R"(getenv\("VELATURA_TEST_ASSETS|\bshared/assets\b)");
    return lines_matching(file, pattern, "ask test_assets.h for the folder");
}

std::vector<std::string> check_worst_of_numbers(const SourceFile& file) {
    const auto includes_hard_case = [](const std::string& line) {
        return line.starts_with("#include") && line.find("hard_case.h\"") != std::string::npos;
    };
    if (!file.is_below("tests/") ||
        std::none_of(file.lines.begin(), file.lines.end(), includes_hard_case))
        return {};
    static const std::regex pattern(R"(\bworst\w*(\[\w+\])? = std::max\(worst)");
    return lines_matching(file, pattern, "std::max forgets NaN: hardcase::larger");
}

std::vector<std::string> check_pages(const SourceFile& file, const std::vector<SourceFile>& tree) {
    // They name pages that nobody has written
    if (file.path == "tests/meta/rules_test.cpp" || file.path == "tests/docs/links.py") return {};
    static const std::regex pattern(R"([\w./:-]+\.md\b)");
    const auto exists = [&](const fs::path& path) {
        const std::string name = path.lexically_normal().generic_string();
        return std::any_of(tree.begin(), tree.end(),
                           [&](const SourceFile& f) { return f.path == name; });
    };
    // By its name alone: docs/*/PAGE
    const auto exists_in_a_part_of_docs = [&](const std::string& page) {
        return page.find('/') == std::string::npos &&
               std::any_of(tree.begin(), tree.end(), [&](const SourceFile& f) {
                   return f.is_below("docs/") && base_name(f.path) == page &&
                          parent_folder(parent_folder(f.path)) == "docs";
               });
    };
    std::vector<std::string> out;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        const std::string& line = file.lines[i];
        if (line.find(".md") == std::string::npos) continue;
        for (std::sregex_iterator match(line.begin(), line.end(), pattern), end; match != end;
             ++match) {
            std::string page = match->str();
            if (page.find("://") != std::string::npos) continue;  // elsewhere
            // As code writes it after the folder of the source tree
            if (page.starts_with("/")) page.erase(0, 1);
            const bool is_link =
                file.ends_with(".md") && line.substr(0, size_t(match->position())).ends_with("](");
            if (!exists(fs::path(parent_folder(file.path)) / page) &&
                (is_link || (!exists(fs::path("docs") / page) && !exists(page) &&
                             !exists_in_a_part_of_docs(page))))
                out.push_back(violation(file, i + 1, "there is no page " + page));
        }
    }
    return out;
}

std::vector<std::string> check_named_sources(const SourceFile& file,
                                             const std::vector<SourceFile>& tree) {
    const bool is_guide = file.is_below("docs/engineering/") || file.path == "CONTRIBUTING.md" ||
                          base_name(file.path) == "README.md";
    if (!is_guide) return {};
    static const std::regex pattern(R"(`([\w./-]+\.(?:cpp|h))`( \((?:[^()]|\(\))*\))?)");
    static const std::regex name(R"(`([\w:]*?(\w+))(?:\(\))?`)");
    const auto find = [&](const fs::path& path) {
        const std::string normal = path.lexically_normal().generic_string();
        const auto found = std::find_if(tree.begin(), tree.end(),
                                        [&](const SourceFile& f) { return f.path == normal; });
        return found == tree.end() ? nullptr : &*found;
    };
    std::vector<std::string> out;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        const std::string& line = file.lines[i];
        // A name without its folder is of the same folder as the one before it
        fs::path folder = parent_folder(file.path);
        for (std::sregex_iterator match(line.begin(), line.end(), pattern), end; match != end;
             ++match) {
            const std::string path = (*match)[1];
            const SourceFile* source = find(folder / path);
            if (!source) source = find(path);
            if (!source) source = find(fs::path("src") / path);
            if (!source) source = find(fs::path(parent_folder(file.path)) / path);
            if (!source) {
                out.push_back(violation(file, i + 1, "there is no " + path));
                continue;
            }
            folder = parent_folder(source->path);
            const std::string more = (*match)[2];
            for (std::sregex_iterator inner(more.begin(), more.end(), name); inner != end;
                 ++inner) {
                const std::regex word("\\b" + (*inner)[2].str() + "\\b");
                if (std::none_of(source->lines.begin(), source->lines.end(),
                                 [&](const std::string& l) { return std::regex_search(l, word); }))
                    out.push_back(violation(file, i + 1,
                                            source->path + " does not name " + (*inner)[1].str()));
            }
        }
    }
    return out;
}

std::vector<std::string> check_tier_readmes(const std::vector<SourceFile>& tree) {
    std::vector<std::string> out;
    for (const auto& [tier, right] : tier_table()) {
        const std::string folder = (tier.starts_with("compositor") ? "" : "src/") + tier + "/";
        const auto has = [&](const std::string& name) {
            return std::find_if(tree.begin(), tree.end(),
                                [&](const SourceFile& f) { return f.path == folder + name; });
        };
        if (has("CMakeLists.txt") == tree.end()) continue;
        const auto readme = has("README.md");
        if (readme == tree.end()) {
            out.push_back(folder + "README.md: is missing");
        } else if (readme->lines.size() > 40) {
            out.push_back(violation(*readme, 41, "more than 40 lines"));
        }
    }
    return out;
}

std::vector<std::string> check_listed_in_cmake(const std::vector<SourceFile>& tree) {
    std::vector<std::string> out;
    for (const SourceFile& file : tree) {
        if (!file.is_cpp_or_header()) continue;
        if (file.is_below("tests/") && file.ends_with(".h")) continue;
        // The CMakeLists.txt of the folder or of one above names every source
        std::optional<bool> is_listed;
        for (std::string folder = parent_folder(file.path); !folder.empty();
             folder = parent_folder(folder)) {
            const auto list = std::find_if(tree.begin(), tree.end(), [&](const SourceFile& f) {
                return f.path == folder + "/CMakeLists.txt";
            });
            if (list == tree.end()) continue;
            const std::string name = base_name(file.path);
            const std::regex word("(^|[\\s/(\"])" +
                                  std::regex_replace(name, std::regex(R"(\.)"), "\\.") +
                                  "($|[\\s)\"])");
            is_listed =
                is_listed.value_or(false) ||
                std::any_of(list->lines.begin(), list->lines.end(),
                            [&](const std::string& line) { return std::regex_search(line, word); });
        }
        if (is_listed == false) out.push_back(violation(file, 1, "no CMakeLists.txt names it"));
    }
    return out;
}

std::vector<std::string> check_root_entries(const std::vector<std::string>& names) {
    static const std::set<std::string> house = {"src",
                                                "compositor",
                                                "plugins",
                                                "tests",
                                                "scenes",
                                                "docs",
                                                "examples",
                                                ".ci",
                                                ".github",
                                                "dev",
                                                "CMakeLists.txt",
                                                "CMakePresets.json",
                                                "README.md",
                                                "CONTRIBUTING.md",
                                                "CHANGELOG.md",
                                                "SECURITY.md",
                                                "LICENSE",
                                                "NOTICE",
                                                ".git",
                                                ".gitignore",
                                                ".git-blame-ignore-revs",
                                                ".clang-format",
                                                ".clang-tidy",
                                                ".clangd",
                                                ".editorconfig",
                                                "build",
                                                "out",
                                                ".cache",
                                                ".vscode",
                                                "compile_commands.json"};
    std::vector<std::string> out;
    for (const std::string& name : names) {
        if (!house.contains(name)) out.push_back(name + ": does not belong into the root");
    }
    return out;
}

}  // namespace velatura::meta
