// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/prim_index.h"
#include "usd/compose/site.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::compose {

class Composer;
class PrimIndexer;

/// The index under construction for whose sake another index is built: an arc from `parent` of that
/// graph leads to `requested`, whose ancestors are being composed first.
struct IndexFrame {
    const PrimIndexer* indexer = nullptr;  ///< of the graph that waits
    int parent = -1;                       ///< node of that graph the arc starts from
    ArcType arc = ArcType::Root;           ///< the arc
    MapPtr to_parent = nullptr;            ///< requested namespace → parent's namespace
    layer::Path requested;                 ///< site the arc leads to
    bool skip_duplicates = false;          ///< leave out sites that the waiting graph has already
};

/// Follows the arcs of one prim: starts from the graph of its parent prim with the child's name
/// appended to all sites, and runs tasks in a fixed order of kinds until none is left.
/// Ref: AOUSD Core Specification 1.0.1, §10; the kinds of tasks and their order follow Pixar's Pcp.
class PrimIndexer {
  public:
    PrimIndexer(Composer& composer,
                PrimIndex& index,
                layer::Path stage_path,
                const IndexFrame* frame);

    /// Makes the graph of one site without arcs.
    void start(LayerStack* stack, layer::Path path);
    /// Steps down to a child prim. `root_contributes`: the site itself may hold opinions.
    void descend(layer::Token name, bool parent_is_instance, bool root_contributes = true);
    /// Follows every arc of the nodes.
    void run();
    /// Drops what contributes nothing, and puts the nodes in order. Of a stage's prim only.
    void finish();

  private:
    /// In the order in which they are done.
    enum Task : uint8_t {
        Relocates,
        ImpliedRelocates,
        References,
        Payloads,
        Inherits,
        Specializes,
        ImpliedClasses,
        AncestralVariantSets,
        AncestralVariants,
        AncestralFallbacks,
        ImpliedSpecializes,
        VariantSets,
        Variants,
        Fallbacks,
        UnresolvedPaths,
        TaskCount
    };

    struct VariantTask {
        int node;
        layer::Path site;  ///< that has the variant set: the node's, or an ancestor of it
        std::string set;
        int number;  ///< of the set at its site
    };

    struct ArcRequest {
        ArcType arc = ArcType::Reference;
        int parent = -1;
        int origin = -1;
        LayerStack* stack = nullptr;
        layer::Path path;
        MapPtr map = nullptr;
        int number = 0;                              ///< place in its list
        std::optional<size_t> namespace_depth = {};  ///< of the parent's path when not given
        bool contributes = true;
        bool ancestral = false;  ///< bring the opinions that the site's ancestors imply
        bool skip_duplicates = false;
        bool skip_implied_specializes = false;
        bool skip_authored_arcs = false;
        SourceLoc loc = {};
    };

    /// What add_tasks leaves out, or adds, for a new part of the graph.
    struct TaskFilter {
        bool skip_authored_arcs = false;
        bool skip_implied_specializes = false;
        bool with_unresolved_paths = false;
        bool with_ancestral_variants = false;
    };

    /// Steps from a node of this graph to the roots of it and of the graphs that wait.
    struct Climber {
        const PrimIndexer* indexer;
        int node;
        const IndexFrame* frame;

        explicit operator bool() const { return indexer != nullptr; }

        const Node& here() const;
        ArcType arc() const;
        void up();
        void next_frame();
    };

    Climber climb(int node) const { return {this, node, frame_}; }

    // Growing the graph
    int add_arc(ArcRequest request);
    Node arc_node(const ArcRequest& request) const;
    int add_node(const ArcRequest& request);
    int add_graph(const ArcRequest& request);
    bool is_within_limits(const ArcRequest& request);
    bool makes_cycle(const ArcRequest& request) const;
    bool is_duplicate(const ArcRequest& request) const;
    std::string describe_cycle(const ArcRequest& request) const;
    MapPtr arc_map(int parent, layer::Path source, TimeOffset offset, bool root_identity) const;

    // Tasks
    void add_task(Task task, int node);
    void add_tasks_below(int node, const TaskFilter& filter);
    void add_tasks(int node, const TaskFilter& filter);
    void scan_ancestral_variants(int node);
    bool run_next();
    void run_task(Task task, int node);

    // Relocates
    bool drop_if_prohibited();
    void eval_relocates(int node);
    void eval_implied_relocates(int node);
    void cull_subtree(int node);
    void cull_relocated(int node);

    // References and payloads
    void eval_references(int node, bool payloads);
    void eval_reference(int node, const SiteReference& reference, int number, ArcType arc);
    bool includes_payloads(int node);
    void check_resolved(int node);

    // Classes
    void eval_classes(int node, ArcType arc);
    int add_class_arc(ArcRequest request, const LayerStack* same_stack, layer::Path same_path);
    int implied_class_start(int class_node) const;
    void eval_implied_classes(int node);
    void imply_class_tree(int dest, int source, const MapFunction& transfer, bool is_start);
    int matching_child(int parent, const ArcRequest& request, size_t depth) const;

    // Specializes
    void eval_implied_specializes(int node);
    int specialize_start(int node) const;
    void propagate_to_root(int parent, int source, MapPtr map, int tree);
    void find_specializes(int node);
    void propagate_to_origin(int parent, int source, MapPtr map, int tree);
    int propagate_node(int parent, int source, MapPtr map, int tree, bool to_root);

    // Variants
    void add_variant_tasks(int node, layer::Path site, bool ancestral);
    void eval_ancestral_variant_sets(int node);
    bool run_variant(Task task);
    void eval_variant(const VariantTask& task, bool ancestral, bool fallback);
    void add_variant_arc(const VariantTask& task, const std::string& selection, bool ancestral);
    void retry_variants();
    std::optional<std::string> variant_selection(int node,
                                                 layer::Path site,
                                                 const std::string& set);
    std::string variant_fallback(const VariantTask& task) const;
    bool may_speak_at(int node, layer::Path path) const;

    // Ending
    bool can_be_culled(int node) const;
    void cull_empty(int node, std::vector<int>* culled);
    bool cull_matching(int node, const std::vector<int>& culled);

    void report(
        ErrorKind kind, int node, SourceLoc loc, std::string message, const char* code = "");
    void report_all(std::vector<CompositionError>& errors, int node);

    PrimGraph& graph() { return index_.graph_; }

    const PrimGraph& graph() const { return index_.graph_; }

    const Node& node(int i) const { return index_.graph_[i]; }

    Composer& composer_;
    PrimIndex& index_;
    layer::Path stage_path_;  ///< prim of the stage in whose service this runs
    const IndexFrame* frame_;
    std::array<std::vector<int>, TaskCount> tasks_;
    std::array<std::vector<VariantTask>, 4> variants_;  ///< see variant_queue()
    std::vector<VariantTask> unselected_[2];            ///< plain, ancestral
    bool overflow_ = false;
};

}  // namespace velatura::usd::compose
