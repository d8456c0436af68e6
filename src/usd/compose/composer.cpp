// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"

#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <unordered_set>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

Composer::Composer(ComposeOptions options, Diagnostics& diagnostics)
    : options_(std::move(options)),
      diagnostics_(diagnostics),
      registry_(options_.search_paths, options_.max_layers, diagnostics) {}

Result<LayerStack*> Composer::open(const std::string& root_file, const std::string& session_file) {
    Result<LayerPtr> root = registry_.open(root_file);
    if (!root) return root.error();
    LayerPtr session;
    if (!session_file.empty()) {
        Result<LayerPtr> opened = registry_.open(session_file);
        if (!opened) return opened.error();
        session = *opened;
    }
    root_stack_owner_ = build_layer_stack(*root, session, registry_, diagnostics_);
    root_stack_ = root_stack_owner_.get();
    return root_stack_;
}

Result<LayerStack*> Composer::layer_stack(const std::string& file) {
    // A reference to the root layer reaches its stack without the session layer
    if (root_stack_ && file == root_stack_->identifier() &&
        root_stack_->layers().front().layer->identifier() == file) {
        return root_stack_;
    }
    const auto known = stacks_.find(file);
    if (known != stacks_.end()) return known->second.get();
    Result<LayerPtr> root = registry_.open(file);
    if (!root) return root.error();
    auto stack = build_layer_stack(*root, nullptr, registry_, diagnostics_);
    LayerStack* result = stack.get();
    stacks_.emplace(file, std::move(stack));
    return result;
}

PrimIndex Composer::root_index() {
    PrimIndex index;
    PrimIndexer indexer(*this, index, Path::absolute_root(), nullptr);
    indexer.start(root_stack_, Path::absolute_root());
    indexer.run();
    return index;
}

PrimIndex Composer::child_index(const PrimIndex& parent, Token name, bool parent_is_instance) {
    PrimIndex index = parent;
    PrimIndexer indexer(*this, index, parent.path().append_child(name), nullptr);
    indexer.descend(name, parent_is_instance);
    indexer.run();
    return index;
}

PrimIndex Composer::site_index(LayerStack* stack,
                               Path path,
                               Path stage_path,
                               const IndexFrame* frame) {
    PrimIndex index;
    PrimIndexer(*this, index, stage_path, frame).start(stack, Path::absolute_root());
    for (const Path& prefix : path.prefixes()) {
        PrimIndexer indexer(*this, index, stage_path, frame);
        indexer.descend(prefix.name(), false);
        indexer.run();
    }
    return index;
}

std::vector<Token> Composer::child_names(const PrimIndex& index, bool is_instance) const {
    std::vector<Token> names;
    std::unordered_set<Token> present;
    const auto& ranked = index.contributing();
    for (auto i = ranked.rbegin(); i != ranked.rend(); ++i) {
        if (is_instance && !index.is_instance_node(*i)) continue;
        const Node& n = index.nodes()[size_t(*i)];
        for (auto entry = n.stack->layers().rbegin(); entry != n.stack->layers().rend(); ++entry) {
            const layer::Spec* spec = entry->layer->spec(n.path);
            if (!spec) continue;
            for (const Token& name : spec->prim_children()) {
                if (present.insert(name).second) names.push_back(name);
            }
            const layer::Value* order = spec->field(layer::fields().prim_order);
            if (!order) continue;
            const auto wanted = order->as_array<Token>();
            layer::reorder_items(names, std::vector<Token>(wanted.begin(), wanted.end()));
        }
    }
    return names;
}

Path map_to_root(const Node& node, Path path) {
    return node.to_root->to_target(path.strip_variant_selections());
}

}  // namespace velatura::usd::compose
