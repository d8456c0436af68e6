// SPDX-License-Identifier: Apache-2.0
// The table of paths. Ref: AOUSD Core Specification 1.0.1, 16.3.8.4.5; the form before 0.4 from
// OpenUSD.
#include "usd/crate/crate_file.h"

#include <fmt/format.h>

#include <cstdlib>

namespace velatura::usd::crate {

namespace {

using layer::Path;
using layer::Token;

/// Appends elements, checking the names: each token once.
class PathBuilder {
  public:
    explicit PathBuilder(const CrateFile& file) : file_(file), checked_(file.tokens.size()) {}

    /// An empty path when the token is no name of such an element.
    Path append(Path parent, uint32_t token, bool is_property) {
        const Token name = file_.tokens[token];
        if (is_property) return is_good(token, property) ? parent.append_property(name) : Path();
        const char first = name.empty() ? '\0' : name.view().front();
        if (first == '{' || first == '[' || first == '.') {
            return append_marked(parent, name.view());
        }
        return is_good(token, prim) ? parent.append_child(name) : Path();
    }

  private:
    static constexpr uint8_t prim = 1;
    static constexpr uint8_t property = 4;

    /// Two bits for each kind of name: looked at, good.
    bool is_good(uint32_t token, uint8_t kind) {
        uint8_t& known = checked_[token];
        if ((known & kind) == 0) {
            const std::string_view text = file_.tokens[token].view();
            const bool good =
                kind == prim ? layer::is_identifier(text) : layer::is_namespaced_identifier(text);
            known = uint8_t(known | kind | (good ? kind << 1 : 0));
        }
        return (known & (kind << 1)) != 0;
    }

    static Path append_marked(Path parent, std::string_view text) {
        if (text.front() == '{' && text.back() == '}') {
            const size_t equals = text.find('=');
            if (equals == std::string_view::npos) return {};
            const std::string_view set = text.substr(1, equals - 1);
            const std::string_view variant = text.substr(equals + 1, text.size() - equals - 2);
            if (!layer::is_identifier(set)) return {};
            if (!variant.empty() && !layer::is_variant_name(variant)) return {};
            return parent.append_variant_selection(Token(set), Token(variant));
        }
        if (text.front() == '[' && text.back() == ']') {
            return parent.append_target(Path::from(text.substr(1, text.size() - 2)));
        }
        constexpr std::string_view mapper = ".mapper[";
        if (text == ".expression") return parent.append_expression();
        if (text.starts_with(mapper) && text.back() == ']') {
            text.remove_prefix(mapper.size());
            return parent.append_mapper(Path::from(text.substr(0, text.size() - 1)));
        }
        const std::string_view name = text.substr(1);
        if (text.front() != '.' || !layer::is_namespaced_identifier(name)) return {};
        if (parent.kind() == layer::PathKind::Mapper) {
            return parent.append_mapper_argument(Token(name));
        }
        return parent.append_relational_attribute(Token(name));
    }

    const CrateFile& file_;
    std::vector<uint8_t> checked_;
};

/// One entry of the table, whatever its form in the file.
struct Entry {
    uint32_t path = 0;
    uint32_t token = 0;
    bool is_property = false;
    bool has_child = false;
    bool has_sibling = false;
    uint64_t sibling = 0;  ///< place of the sibling when there is a child too
};

/// Walks the tree; `entry_at(place, next)` reads an entry and says where the one after it is.
/// Depth first with a list of what is left to do: trees may be deeper than the stack.
template <class EntryAt>
void walk(CrateFile& file,
          Cursor& c,
          uint64_t first,
          uint64_t max_entries,
          size_t& bad_paths,
          const EntryAt& entry_at) {
    struct Pending {
        uint64_t place;
        Path parent;
        bool is_bad;
    };

    PathBuilder builder(file);
    std::vector<Pending> pending{{first, Path(), false}};
    uint64_t entries = 0;
    while (!pending.empty()) {
        auto [place, parent, is_bad] = pending.back();
        pending.pop_back();
        for (bool continues = true; continues;) {
            // Jumps may lead anywhere: what is visited twice makes more entries than there are
            if (++entries > max_entries) {
                c.fail("paths in a cycle", "a tree");
                return;
            }
            uint64_t next = 0;
            const Entry e = entry_at(place, next);
            if (!c.ok()) return;
            if (e.path >= file.paths.size() || e.token >= file.tokens.size()) {
                c.fail(fmt::format("path {} with token {}", e.path, e.token),
                       fmt::format("at most {} paths and {} tokens", file.paths.size(),
                                   file.tokens.size()));
                return;
            }
            const bool is_root = parent.is_empty() && !is_bad;
            Path path;
            if (is_root) {
                path = Path::absolute_root();
                parent = path;
            } else if (!is_bad) {
                path = builder.append(parent, e.token, e.is_property);
            }
            if (path.is_empty()) ++bad_paths;
            file.paths[e.path] = path;
            if (e.has_child && e.has_sibling) pending.push_back({e.sibling, parent, is_bad});
            if (e.has_child) {
                parent = path;
                is_bad = path.is_empty();
            }
            place = next;
            continues = e.has_child || e.has_sibling;
        }
    }
}

void read_compressed(CrateFile& file, Cursor& c, size_t& bad_paths) {
    const uint64_t at = c.at();
    const auto n = c.read<uint64_t>();
    if (n > file.paths.size()) {
        c.fail_at(at, fmt::format("{} entries", n), fmt::format("at most {}", file.paths.size()));
        return;
    }
    std::vector<int32_t> paths;
    std::vector<int32_t> tokens;
    std::vector<int32_t> jumps;
    if (!read_integers(c, n, paths) || !read_integers(c, n, tokens) || !read_integers(c, n, jumps))
        return;
    if (n == 0) return;
    walk(file, c, 0, n, bad_paths, [&](uint64_t i, uint64_t& next) {
        Entry e;
        if (i >= n) {
            c.fail(fmt::format("a jump to entry {}", i), fmt::format("one of {}", n));
            return e;
        }
        // Through unsigned, as the least integer has no opposite
        e.is_property = tokens[i] < 0;
        e.token = e.is_property ? 0u - uint32_t(tokens[i]) : uint32_t(tokens[i]);
        e.path = uint32_t(paths[i]);
        e.has_child = jumps[i] > 0 || jumps[i] == -1;
        e.has_sibling = jumps[i] >= 0;
        e.sibling = i + uint64_t(jumps[i] > 0 ? jumps[i] : 0);
        next = i + 1;
        return e;
    });
}

void read_plain(CrateFile& file, Cursor& c, size_t& bad_paths) {
    constexpr uint8_t child_bit = 1;
    constexpr uint8_t sibling_bit = 2;
    constexpr uint8_t property_bit = 4;
    const bool is_padded = file.version < Version{0, 1, 0};
    walk(file, c, c.at(), file.paths.size(), bad_paths, [&](uint64_t place, uint64_t& next) {
        Entry e;
        if (!c.seek(place)) return e;
        if (is_padded) c.read<uint32_t>();
        e.path = c.read<uint32_t>();
        e.token = c.read<uint32_t>();
        const uint32_t bits = c.read<uint32_t>();
        e.is_property = (bits & property_bit) != 0;
        e.has_child = (bits & child_bit) != 0;
        e.has_sibling = (bits & sibling_bit) != 0;
        if (e.has_child && e.has_sibling) e.sibling = c.read<uint64_t>();
        next = c.at();
        return e;
    });
}

}  // namespace

void read_paths(CrateFile& file, Cursor& cursor, size_t& bad_paths) {
    const uint64_t at = cursor.at();
    const auto n = cursor.read<uint64_t>();
    if (n > file.max_items()) {
        cursor.fail_at(at, fmt::format("{} paths", n), fmt::format("at most {}", file.max_items()));
        return;
    }
    if (!cursor.ok()) return;
    file.paths.resize(n);
    if (file.version >= Version{0, 4, 0}) {
        read_compressed(file, cursor, bad_paths);
    } else if (n > 0) {
        read_plain(file, cursor, bad_paths);
    }
}

}  // namespace velatura::usd::crate
