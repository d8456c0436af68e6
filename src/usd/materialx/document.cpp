// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/document.h"

#include "base/asset_bytes.h"
#include "base/asset_roots.h"
#include "base/package_path.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <set>

namespace velatura::usd::materialx {

namespace fs = std::filesystem;

namespace {

constexpr size_t deepest_include = 16;
constexpr size_t max_includes = 256;

/// The file that `href` means in the file `from`, which may lie in a package.
std::string beside(const std::string& from, std::string_view href) {
    if (!check_asset_name(href)) return std::string(href);
    const fs::path path(href);
    std::vector<std::string> parts = split_package_path(from);
    parts.back() = (fs::path(parts.back()).parent_path() / path).lexically_normal().string();
    return join_package_path(parts);
}

/// Gives the attribute to what does not say otherwise.
void inherit(XmlElement& element, std::string_view name, const std::string& value) {
    if (!value.empty() && element.attribute(name).empty())
        element.attributes.emplace_back(name, value);
}

/// Reads one file after the other into a document.
struct Including {
    Document& document;
    Diagnostics& diagnostics;
    std::set<std::string> seen = {};

    void error(SourceLoc where, std::string message) {
        diagnostics.error("mtlx-include", where, "", std::move(message));
    }

    void follow(const XmlElement& element, const std::string& from, size_t depth);
    Result<void> add(std::string_view bytes,
                     const std::string& file,
                     const std::string& folder,
                     size_t depth);
};

void Including::follow(const XmlElement& element, const std::string& from, size_t depth) {
    const std::string href(element.attribute("href"));
    if (href.empty()) return error(element.loc, "xi:include without href");
    if (depth >= deepest_include) {
        return error(element.loc,
                     fmt::format("xi:include is nested deeper than {}", deepest_include));
    }
    if (seen.size() > max_includes)
        return error(element.loc, fmt::format("more than {} files included", max_includes));
    const std::string file = beside(from, href);
    // A file that includes itself, or comes twice, has nothing new to say
    if (!seen.insert(file).second) return;
    const Result<AssetBytesPtr> bytes = open_asset_bytes(file);
    if (!bytes) {
        return error(element.loc, fmt::format("included file \"{}\" cannot be read: {}", href,
                                              bytes.error().message));
    }
    // Files that it names are beside it, and the layer is the including one
    std::string folder = fs::path(href).parent_path().generic_string();
    if (!folder.empty()) folder += '/';
    const Result<void> added = add((*bytes)->bytes(), file, folder, depth + 1);
    if (!added) error(element.loc, added.error().message);
}

Result<void> Including::add(std::string_view bytes,
                            const std::string& file,
                            const std::string& folder,
                            size_t depth) {
    Result<XmlElement> root = read_xml(bytes, file, diagnostics);
    if (!root) return root.error();
    if (root->name != "materialx") {
        return Error{"mtlx-document", fmt::format("\"{}\" is not a MaterialX document: its root "
                                                  "element is <{}>, expected <materialx>",
                                                  file, root->name)};
    }
    if (!root->attribute("namespace").empty()) {
        diagnostics.warn("mtlx-unsupported", root->loc, "",
                         fmt::format("namespace {} is ignored; names stay as they are",
                                     root->attribute("namespace")));
    }
    if (depth == 0) {
        int minor = 38;
        const std::string_view version = root->attribute("version");
        if (const size_t dot = version.find('.'); dot != std::string_view::npos)
            std::from_chars(version.data() + dot + 1, version.data() + version.size(), minor);
        document.is_before_139 = minor < 39;
    }
    const std::string space(root->attribute("colorspace"));
    const std::string prefix = folder + std::string(root->attribute("fileprefix"));
    for (XmlElement& element : root->children) {
        if (element.name == "xi:include") {
            follow(element, file, depth);
            continue;
        }
        inherit(element, "colorspace", space);
        inherit(element, "fileprefix", prefix);
        document.elements.push_back(std::move(element));
    }
    return {};
}

}  // namespace

Result<Document> read_document(std::string_view bytes,
                               const std::string& file,
                               Diagnostics& diagnostics) {
    Document document;
    document.file = file;
    Including including{document, diagnostics, {file}};
    const Result<void> added = including.add(bytes, file, "", 0);
    if (!added) return added.error();
    return document;
}

}  // namespace velatura::usd::materialx
