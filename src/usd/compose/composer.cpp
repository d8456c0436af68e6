// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"

#include "usd/compose/prim_indexer.h"
#include "usd/layer/expression.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// Layers with more specs are not searched for files to read ahead.
constexpr size_t max_scanned_specs = 100'000;

}  // namespace

Composer::Composer(ComposeOptions options, Diagnostics& diagnostics)
    : options_(std::move(options)),
      diagnostics_(diagnostics),
      errors_(diagnostics),
      registry_(options_.search_paths, options_.max_layers, diagnostics) {
    registry_.set_reads_materialx(options_.reads_materialx);
}

Result<LayerStack*> Composer::open(const std::string& root_file, const SessionLayers& session) {
    // A made layer of the root layer's name is the root layer
    const bool is_made = session.made && session.made->identifier() == root_file;
    if (is_made) registry_.add(session.made);
    Result<LayerPtr> root = registry_.open(root_file);
    if (!root) return root.error();
    std::vector<LayerPtr> sessions;
    if (session.made && !is_made) {
        registry_.add(session.made);
        sessions.push_back(session.made);
    }
    for (const std::string& file : session.files) {
        Result<LayerPtr> opened = registry_.open(file);
        if (!opened) return opened.error();
        sessions.push_back(*opened);
    }
    const bool has_session = !sessions.empty();
    std::vector<CompositionError> errors;
    auto stack = build_layer_stack({*root, std::move(sessions)}, registry_, diagnostics_, errors);
    root_stack_ = add_stack(std::move(stack), errors);
    // A reference to the root layer reaches its stack without the session layers
    if (!has_session) stack_of_.emplace(root_stack_->identifier() + '|', root_stack_);
    return root_stack_;
}

LayerStack* Composer::add_stack(std::unique_ptr<LayerStack> stack,
                                const std::vector<CompositionError>& errors) {
    for (const CompositionError& error : errors) errors_.add(error);
    for (const StackLayer& entry : stack->layers()) {
        if (counted_.insert(entry.layer.get()).second) spec_count_ += entry.layer->spec_count();
    }
    stacks_.push_back(std::move(stack));
    prefetch_arcs(*stacks_.back());
    return stacks_.back().get();
}

Result<LayerStack*> Composer::layer_stack(const std::string& file, const LayerStack& referrer) {
    // A stack without variables of its own is shared by all referrers of one source; which it is,
    // is known only when it has been built
    const std::string key = file + '|' + referrer.variables_source();
    const auto known = stack_of_.find(key);
    if (known != stack_of_.end()) return known->second;
    Result<LayerPtr> root = registry_.open(file);
    if (!root) return root.error();
    // One layer may have several names, as a package and its root layer
    const std::string own_key = (*root)->identifier() + '|' + referrer.variables_source();
    const auto same = stack_of_.find(own_key);
    LayerStack* result = nullptr;
    if (same != stack_of_.end()) {
        result = same->second;
    } else {
        std::vector<CompositionError> errors;
        result = add_stack(
            build_layer_stack({*root, {}, &referrer}, registry_, diagnostics_, errors), errors);
        stack_of_.emplace(own_key, result);
    }
    stack_of_.emplace(key, result);
    return result;
}

void Composer::prefetch_arcs(const LayerStack& stack) {
    std::set<std::string> files;
    std::set<std::string> assets;
    const auto add_items = [&](const auto* op) {
        if (!op) return;
        for (const auto* items : {&op->explicit_items, &op->added, &op->prepended, &op->appended}) {
            for (const auto& item : *items) {
                if (!item.asset.empty() && !layer::is_expression(item.asset))
                    assets.insert(item.asset);
            }
        }
    };
    const bool with_payloads =
        !options_.load_payloads && options_.payloads == PayloadPolicy::LoadAll;
    for (const StackLayer& entry : stack.layers()) {
        const layer::Layer& layer = *entry.layer;
        if (layer.spec_count() > max_scanned_specs) continue;
        layer.for_each_spec(Path::absolute_root(), [&](Path path, const layer::Spec& spec) {
            // Which variants will be selected is not known yet
            if (spec.kind() != layer::SpecKind::Prim || path.has_variant_selection()) return;
            const layer::FieldNames& names = layer::fields();
            add_items(spec.field_as<layer::ReferenceListOp>(names.references));
            if (!with_payloads) return;
            add_items(spec.field_as<layer::ReferenceListOp>(names.payload));
            add_items(spec.field_as<layer::PayloadListOp>(names.payload));
        });
        for (const std::string& asset : assets)
            files.insert(registry_.resolve(asset, layer.identifier()));
        assets.clear();
    }
    registry_.prefetch(std::vector<std::string>(files.begin(), files.end()));
}

PrimIndex Composer::root_index() {
    PrimIndex index;
    PrimIndexer indexer(*this, index, Path::absolute_root(), nullptr);
    indexer.start(root_stack_, Path::absolute_root());
    return index;
}

PrimIndex Composer::child_index(const PrimIndex& parent, Token name, bool parent_is_instance) {
    index_nodes_ = 0;
    index_path_ = parent.path().append_child(name);
    PrimIndex index = parent;
    PrimIndexer indexer(*this, index, index_path_, nullptr);
    indexer.descend(name, parent_is_instance);
    indexer.run();
    indexer.finish();
    node_count_ += index_nodes_ + index.nodes().size();
    return index;
}

PrimIndex Composer::prim_index(Path path) {
    PrimIndex index = root_index();
    for (const Path& prefix : path.prefixes()) {
        if (!prefix.is_prim()) return {};
        index = child_index(index, prefix.name(), index.is_instanceable());
    }
    return index;
}

PrimIndex Composer::site_index(
    LayerStack* stack, Path path, Path stage_path, bool contributes, const IndexFrame* frame) {
    // A variant stands for itself: what its prim's ancestors say came with the prim
    const std::vector<Path> prefixes = path.prefixes();
    size_t next = prefixes.size();
    while (next > 0 && !prefixes[next - 1].is_variant_selection()) --next;
    PrimIndex index;
    {
        PrimIndexer indexer(*this, index, stage_path, frame);
        indexer.start(stack, next == 0 ? Path::absolute_root() : prefixes[next - 1]);
        if (next > 0) indexer.run();
    }
    for (; next < prefixes.size(); ++next) {
        const bool is_last = next + 1 == prefixes.size();
        const bool is_instance = index.is_instanceable();
        if (!spend(1)) break;
        PrimIndexer indexer(*this, index, stage_path, frame);
        indexer.descend(prefixes[next].name(), is_instance, contributes || !is_last);
        indexer.run();
    }
    return index;
}

size_t Composer::node_limit() const {
    return std::max(options_.min_node_limit, spec_count_ * options_.max_nodes_per_spec);
}

bool Composer::spend(size_t nodes) {
    index_nodes_ += nodes;
    if (node_count_ + index_nodes_ > node_limit()) exhaust(index_path_);
    return !is_exhausted_ && index_nodes_ <= options_.max_nodes_per_prim * 4;
}

void Composer::exhaust(Path path) {
    if (is_exhausted_) return;
    is_exhausted_ = true;
    const std::string message =
        prim_count_ >= options_.max_prims
            ? fmt::format("limit of {} prims reached; the rest is skipped; raise --limit prims",
                          options_.max_prims)
            : fmt::format(
                  "limit of {} composed sites for {} specs reached; the rest is skipped; raise "
                  "--limit prims-per-spec",
                  node_limit(), spec_count_);
    errors_.add({ErrorKind::CapacityExceeded, path, root_stack_->identifier(), path, message,
                 site_loc(*root_stack_, path)},
                "usd-too-many-prims");
}

std::vector<Token> Composer::child_names(const PrimIndex& index, bool is_instance) {
    if (is_exhausted_) return {};
    std::vector<Token> names = all_child_names(index, is_instance).names;
    const size_t room = options_.max_prims - prim_count_;
    prim_count_ += std::min(room, names.size());
    if (names.size() > room) {
        names.resize(room);
        exhaust(index.path());
    }
    return names;
}

Path map_to_root(const Node& node, Path path) {
    return node.to_root->to_target(path.strip_variant_selections());
}

}  // namespace velatura::usd::compose
