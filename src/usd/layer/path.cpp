// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/path.h"

#include "base/check.h"
#include "base/hash.h"
#include "usd/layer/path_node.h"
#include "usd/layer/pointer_table.h"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>

namespace velatura::usd::layer {

/// Interns nodes; the only place that makes them.
struct PathTable {
    static uint64_t hash(const Path::Node& n) {
        uint64_t h = hash_combine(std::hash<const void*>()(n.parent), n.name.hash());
        if (n.variant != Token() || n.target) {
            h = hash_combine(h, n.variant.hash());
            h = hash_combine(h, n.target.hash());
        }
        return mix64(h + uint64_t(n.kind));
    }

    static bool is_equal(const Path::Node& a, const Path::Node& b) {
        return a.kind == b.kind && a.parent == b.parent && a.name == b.name &&
               a.variant == b.variant && a.target == b.target;
    }

    struct Shard {
        std::mutex mutex;
        PointerTable<const Path::Node> nodes;
    };

    static constexpr int shard_bits = 6;

    /// A copy that lives for ever, next to what this thread made before: a prim and its properties
    /// are looked at together.
    static const Path::Node* keep(const Path::Node& wanted) {
        constexpr size_t block_size = 512;
        thread_local Path::Node* block = nullptr;
        thread_local size_t left = 0;
        if (left == 0) {
            block = new Path::Node[block_size];
            left = block_size;
        }
        --left;
        *block = wanted;
        return block++;
    }

    static Path intern(const Path::Node& wanted) {
        // Never destroyed: paths in static objects must outlive everything
        static auto* const shards = new std::array<Shard, size_t(1) << shard_bits>;
        const uint64_t h = hash(wanted);
        // The tables use the low bits
        Shard& shard = (*shards)[h >> (64 - shard_bits)];
        const std::lock_guard lock(shard.mutex);
        const Path::Node* node =
            shard.nodes.find(h, [&](const Path::Node& n) { return is_equal(n, wanted); });
        if (!node) {
            node = keep(wanted);
            shard.nodes.insert(h, node);
        }
        return Path(node);
    }

    static Path root(PathKind kind) {
        Path::Node node;
        node.kind = kind;
        node.is_absolute = kind == PathKind::AbsoluteRoot;
        return intern(node);
    }

    static Path append(
        Path parent, PathKind kind, Token name, Token variant = {}, Path target = {}) {
        const Path::Node* p = parent.node_;
        if (p == nullptr || p->depth >= Path::max_elements) return {};
        Path::Node node;
        node.parent = p;
        node.kind = kind;
        node.is_absolute = p->is_absolute;
        node.has_variant = p->has_variant || kind == PathKind::VariantSelection;
        node.has_target = p->has_target || kind == PathKind::Target || kind == PathKind::Mapper;
        node.depth = p->depth + 1;
        node.name = name;
        node.variant = variant;
        node.target = target;
        return intern(node);
    }

    static const Path::Node* node(Path p) { return p.node_; }

    static Path path(const Path::Node* n) { return Path(n); }
};

namespace {

/// Path of the same last element as `element` below another parent.
Path append_like(Path parent, const Path::Node& element) {
    switch (element.kind) {
        case PathKind::Prim:
            return parent.append_child(element.name);
        case PathKind::VariantSelection:
            return parent.append_variant_selection(element.name, element.variant);
        case PathKind::Property:
            return parent.append_property(element.name);
        case PathKind::Target:
            return parent.append_target(element.target);
        case PathKind::RelationalAttribute:
            return parent.append_relational_attribute(element.name);
        case PathKind::Mapper:
            return parent.append_mapper(element.target);
        case PathKind::MapperArgument:
            return parent.append_mapper_argument(element.name);
        case PathKind::Expression:
            return parent.append_expression();
        case PathKind::Parent:
            return parent.parent();
        case PathKind::Empty:
        case PathKind::AbsoluteRoot:
        case PathKind::RelativeRoot:
            break;
    }
    return parent;
}

/// Nodes from below `base` (nullptr: from the root element itself) down to `node`.
std::vector<const Path::Node*> chain(const Path::Node* node, const Path::Node* base) {
    std::vector<const Path::Node*> nodes;
    for (; node != nullptr && node != base; node = node->parent) nodes.push_back(node);
    std::reverse(nodes.begin(), nodes.end());
    return nodes;
}

std::strong_ordering compare_elements(const Path::Node& a, const Path::Node& b) {
    // Variants before children, children before properties
    const auto rank = [](PathKind k) { return k == PathKind::VariantSelection ? 0 : 1 + int(k); };
    if (const auto c = rank(a.kind) <=> rank(b.kind); c != 0) return c;
    if (const auto c = a.name <=> b.name; c != 0) return c;
    if (const auto c = a.variant <=> b.variant; c != 0) return c;
    return a.target <=> b.target;
}

}  // namespace

Path Path::absolute_root() {
    static const Path root = PathTable::root(PathKind::AbsoluteRoot);
    return root;
}

Path Path::relative_root() {
    static const Path root = PathTable::root(PathKind::RelativeRoot);
    return root;
}

Path Path::from(std::string_view text) {
    return parse(text).value_or(Path());
}

PathKind Path::kind() const {
    return node_ ? node_->kind : PathKind::Empty;
}

bool Path::is_absolute() const {
    return node_ && node_->is_absolute;
}

bool Path::is_root_prim() const {
    return is_prim() && node_->parent->kind == PathKind::AbsoluteRoot;
}

bool Path::has_variant_selection() const {
    return node_ && node_->has_variant;
}

bool Path::has_target() const {
    return node_ && node_->has_target;
}

size_t Path::element_count() const {
    return node_ ? node_->depth : 0;
}

Path Path::parent() const {
    if (!node_) return {};
    if (node_->kind == PathKind::RelativeRoot || node_->kind == PathKind::Parent)
        return PathTable::append(*this, PathKind::Parent, Token(".."));
    return Path(node_->parent);
}

Token Path::name() const {
    return node_ ? node_->name : Token();
}

Token Path::variant_set() const {
    return is_variant_selection() ? node_->name : Token();
}

Token Path::variant() const {
    return is_variant_selection() ? node_->variant : Token();
}

Path Path::target() const {
    return node_ ? node_->target : Path();
}

Path Path::prim_path() const {
    Path p = *this;
    while (p.node_ && p.kind() > PathKind::Prim) p = Path(p.node_->parent);
    return p;
}

Path Path::append_child(Token prim_name) const {
    if (kind() > PathKind::VariantSelection) return {};
    return PathTable::append(*this, PathKind::Prim, prim_name);
}

Path Path::append_property(Token property_name) const {
    if (kind() > PathKind::VariantSelection || is_absolute_root()) return {};
    return PathTable::append(*this, PathKind::Property, property_name);
}

Path Path::append_variant_selection(Token set, Token variant) const {
    if (!is_prim_or_variant()) return {};
    return PathTable::append(*this, PathKind::VariantSelection, set, variant);
}

Path Path::append_target(Path target) const {
    if (!is_property() || target.is_empty()) return {};
    return PathTable::append(*this, PathKind::Target, {}, {}, target);
}

Path Path::append_relational_attribute(Token name) const {
    if (!is_target()) return {};
    return PathTable::append(*this, PathKind::RelationalAttribute, name);
}

Path Path::append_mapper(Path target) const {
    if (!is_property() || target.is_empty()) return {};
    return PathTable::append(*this, PathKind::Mapper, {}, {}, target);
}

Path Path::append_mapper_argument(Token name) const {
    if (kind() != PathKind::Mapper) return {};
    return PathTable::append(*this, PathKind::MapperArgument, name);
}

Path Path::append_expression() const {
    if (!is_property()) return {};
    return PathTable::append(*this, PathKind::Expression, {});
}

bool Path::has_prefix(Path prefix) const {
    if (!node_ || !prefix.node_ || prefix.node_->depth > node_->depth) return false;
    const Node* n = node_;
    while (n->depth > prefix.node_->depth) n = n->parent;
    return n == prefix.node_;
}

Path Path::replace_prefix(Path old_prefix, Path new_prefix, bool fix_targets) const {
    if (!node_ || !old_prefix.node_ || !new_prefix.node_) return *this;
    const bool is_below = has_prefix(old_prefix);
    if (!is_below && !(fix_targets && has_target())) return *this;
    Path result = is_below ? new_prefix : Path();
    for (const Node* n : chain(node_, is_below ? old_prefix.node_ : nullptr)) {
        Node element = *n;
        if (fix_targets && element.target) {
            element.target = element.target.replace_prefix(old_prefix, new_prefix, true);
        }
        // The first node of a whole chain is its root element
        result = result.is_empty() ? Path(n) : append_like(result, element);
        if (result.is_empty()) return {};
    }
    return result;
}

Path Path::make_absolute(Path anchor) const {
    if (!node_ || (is_absolute() && !has_target())) return *this;
    Path result = is_absolute() ? absolute_root() : anchor.prim_path();
    const Node* base = is_absolute() ? result.node_ : relative_root().node_;
    for (const Node* n : chain(node_, base)) {
        Node element = *n;
        if (element.target) element.target = element.target.make_absolute(anchor);
        result = append_like(result, element);
        // Leave the variants of the anchor along with the prim
        if (element.kind == PathKind::Parent) result = result.prim_path();
        if (result.is_empty()) return {};
    }
    return result;
}

Path Path::strip_variant_selections() const {
    if (!has_variant_selection()) return *this;
    const std::vector<const Node*> nodes = chain(node_, nullptr);
    Path result(nodes.front());
    for (size_t i = 1; i < nodes.size(); ++i) {
        if (nodes[i]->kind != PathKind::VariantSelection) result = append_like(result, *nodes[i]);
    }
    return result;
}

std::vector<Path> Path::prefixes() const {
    std::vector<Path> result;
    for (const Node* n : chain(node_, nullptr)) {
        if (n->parent) result.push_back(Path(n));
    }
    return result;
}

std::string Path::to_string() const {
    std::string text;
    PathKind previous = PathKind::Empty;
    for (const Node* n : chain(node_, nullptr)) {
        switch (n->kind) {
            case PathKind::Empty:
                break;
            case PathKind::AbsoluteRoot:
                text += '/';
                break;
            case PathKind::RelativeRoot:
                break;
            case PathKind::Parent:
                text += previous == PathKind::Parent ? "/.." : "..";
                break;
            case PathKind::Prim:
                if (previous == PathKind::Prim || previous == PathKind::Parent) text += '/';
                text += n->name.str();
                break;
            case PathKind::VariantSelection:
                text += '{' + n->name.str() + '=' + n->variant.str() + '}';
                break;
            case PathKind::Property:
                // "..", then ".b" needs a slash to stay apart
                if (previous == PathKind::Parent) text += '/';
                text += '.' + n->name.str();
                break;
            case PathKind::RelationalAttribute:
            case PathKind::MapperArgument:
                text += '.' + n->name.str();
                break;
            case PathKind::Target:
                text += '[' + n->target.to_string() + ']';
                break;
            case PathKind::Mapper:
                text += ".mapper[" + n->target.to_string() + ']';
                break;
            case PathKind::Expression:
                text += ".expression";
                break;
        }
        previous = n->kind;
    }
    return text.empty() && node_ ? "." : text;
}

std::strong_ordering Path::operator<=>(const Path& o) const {
    if (node_ == o.node_) return std::strong_ordering::equal;
    if (!node_ || !o.node_) return bool(node_) <=> bool(o.node_);
    if (node_->is_absolute != o.node_->is_absolute)
        return o.node_->is_absolute <=> node_->is_absolute;
    // Climb to the same depth, then in step to the parents' meeting point
    const Node* a = node_;
    const Node* b = o.node_;
    while (a->depth > b->depth) a = a->parent;
    while (b->depth > a->depth) b = b->parent;
    if (a == b) return node_->depth <=> o.node_->depth;
    while (a->parent != b->parent) {
        a = a->parent;
        b = b->parent;
    }
    return compare_elements(*a, *b);
}

}  // namespace velatura::usd::layer
