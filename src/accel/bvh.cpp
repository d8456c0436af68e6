// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh.h"

#include "accel/bvh_builder.h"
#include "accel/bvh_collapse.h"
#include "accel/bvh_layout.h"
#include "accel/motion_builder.h"
#include "accel/moving_instances.h"
#include "accel/placement.h"
#include "accel/ray_query.h"
#include "accel/scene_classes.h"
#include "accel/traverse.h"
#include "accel/triangle_numbers.h"
#include "base/check.h"
#include "base/tasks.h"
#include "geometry/geometry_set.h"
#include "scene/scene.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace velatura::accel {

namespace {

struct Corners {
    Vec3 p[3];
};

// The triangles of one tree by their number.
class Triangles final : public TriangleSource {
  public:
    Triangles(std::span<const TriangleSoupView> shapes, const TriangleNumbers& numbers)
        : shapes_(shapes), numbers_(numbers) {}

    Corners of(size_t shape, size_t triangle) const {
        const TriangleSoupView& s = shapes_[shape];
        const auto& v = s.triangles[triangle];
        return {{s.positions[v[0]], s.positions[v[s.second()]], s.positions[v[s.third()]]}};
    }

    Corners operator[](uint32_t id) const {
        const uint32_t shape = numbers_.shape(id);
        return of(shape, id - numbers_.first(shape));
    }

    TriangleCorners4 corners(uint32_t id) const override {
        const Corners c = (*this)[id];
        TriangleCorners4 corners;
        for (int i = 0; i < 3; ++i) corners.p[i] = Vec4{c.p[i].x, c.p[i].y, c.p[i].z, 0};
        return corners;
    }

  private:
    std::span<const TriangleSoupView> shapes_;
    const TriangleNumbers& numbers_;
};

// Of what is_divisible compares. Right triangles in planes of two axes reach 0.5; such floors and
// walls are best met near the root, whole.
constexpr double well_fitting = 0.45;
constexpr size_t min_spare = 4096;  // so that small scenes can be divided, too

class TriangleTreeBuilder {
  public:
    TriangleTreeBuilder(std::span<const TriangleSoupView> shapes,
                        const TriangleNumbers& numbers,
                        const BvhOptions& options)
        : shapes_(shapes), numbers_(numbers), options_(options), corners_(shapes, numbers) {}

    WideTree run(AcceleratorStats& stored) const {
        BinaryBuildOptions binary_options = binary_options_of(options_);
        binary_options.leaf_size = options_.leaf_size;
        binary_options.block = wide;
        binary_options.source = options_.spare_references > 0 ? &corners_ : nullptr;
        binary_options.merge_duplicates = [&](std::span<BuildPrim> range) { return merge(range); };
        BuildPrims prims = collect();
        const size_t collected = prims.count;
        const BinaryTree binary = build_binary_tree(std::move(prims), binary_options);
        std::vector<LeafBlock, LargePages<LeafBlock>> leaves;
        WideTree tree = collapse(
            binary, wide, {}, [&](size_t count) { leaves.resize(count); },
            [&](uint32_t index, std::span<const uint32_t> ids) { fill_block(leaves[index], ids); });
        tree.leaves = std::move(leaves);
        count_triangles(tree.leaves, collected, stored);
        return tree;
    }

  private:
    // With room for what spatial splits may add.
    BuildPrims collect() const {
        const size_t max = numbers_.count();
        const size_t spare = options_.spare_references > 0
                                 ? std::max(size_t(options_.spare_references * double(max)),
                                            std::min(min_spare, 8 * max))
                                 : 0;
        BuildPrims prims(max + spare);
        for (size_t s = 0; s < shapes_.size(); ++s) {
            if (shapes_[s].segments() > 0) continue;
            for (size_t i = 0; i < shapes_[s].triangles.size(); ++i) {
                const Corners c = corners_.of(s, i);
                if (is_degenerate(c.p[0], c.p[1], c.p[2])) continue;
                BuildPrim prim{};
                prim.id = numbers_.first(s) + uint32_t(i);
                for (int k = 0; k < 3; ++k) {
                    prim.lower[k] = std::min(c.p[0][k], std::min(c.p[1][k], c.p[2][k]));
                    prim.upper[k] = std::max(c.p[0][k], std::max(c.p[1][k], c.p[2][k]));
                }
                prim.is_divisible = is_divisible(c, prim);
                prims.push_back(prim);
            }
        }
        return prims;
    }

    // Whether parts of the triangle would have boxes of a much smaller sum of areas. The limit of
    // that sum is the triangle's area projected along the axes.
    // Ref: Karras, Aila 2013, "Fast Parallel Construction of High-Quality Bounding Volume
    // Hierarchies", section 4.
    static bool is_divisible(const Corners& c, const BuildPrim& box) {
        const Vec3d a(c.p[0]), ab = Vec3d(c.p[1]) - a, ac = Vec3d(c.p[2]) - a;
        const Vec3d normal = ab.cross(ac);
        const double min = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
        return min < well_fitting * 2 * half_area(box.lower, box.upper);
    }

    // Keeps the smallest id of triangles with the same corners in the same order.
    size_t merge(std::span<BuildPrim> range) const {
        return merge_equal(range, [&](const BuildPrim& a, const BuildPrim& b) {
            const Corners ca = corners_[a.id], cb = corners_[b.id];
            for (int corner = 0; corner < 3; ++corner) {
                const int order = order_of(ca.p[corner], cb.p[corner]);
                if (order != 0) return order;
            }
            const int shapes = order_of_shapes(numbers_, options_, a.id, b.id);
            if (shapes != 0) return shapes;
            // Parts of one triangle are no duplicates
            return order_of(Vec3(a.lower[0], a.lower[1], a.lower[2]),
                            Vec3(b.lower[0], b.lower[1], b.lower[2]));
        });
    }

    void count_triangles(std::span<const LeafBlock> leaves,
                         size_t collected,
                         AcceleratorStats& stored) const {
        std::vector<bool> seen(numbers_.count());
        for (const LeafBlock& leaf : leaves) {
            for (const uint32_t id : leaf.id) {
                if (id == unused_lane) continue;
                ++stored.references;
                stored.triangles += !seen[id];
                seen[id] = true;
            }
        }
        if (stored.triangles == collected) return;
        const auto is_collected = [&](size_t shape, size_t triangle) {
            if (shapes_[shape].segments() > 0) return false;
            const Corners c = corners_.of(shape, triangle);
            return !is_degenerate(c.p[0], c.p[1], c.p[2]);
        };
        count_duplicates(numbers_, shapes_, seen, is_collected, stored.duplicates);
    }

    void fill_block(LeafBlock& block, std::span<const uint32_t> references) const {
        // Parts of one triangle may meet again here
        std::array<uint32_t, wide> ids{};
        size_t count = 0;
        for (const uint32_t id : references) {
            if (std::find(ids.begin(), ids.begin() + std::ptrdiff_t(count), id) ==
                ids.begin() + std::ptrdiff_t(count))
                ids[count++] = id;
        }
        const Vec3 nowhere(std::numeric_limits<float>::quiet_NaN());
        for (size_t lane = 0; lane < wide; ++lane) {
            const bool is_used = lane < count;
            const Corners c = is_used ? corners_[ids[lane]] : Corners{{nowhere, nowhere, nowhere}};
            block.id[lane] = is_used ? ids[lane] : unused_lane;
            for (int corner = 0; corner < 3; ++corner) {
                for (int k = 0; k < 3; ++k) block.corner[corner][k][lane] = c.p[corner][k];
            }
        }
    }

    std::span<const TriangleSoupView> shapes_;
    const TriangleNumbers& numbers_;
    const BvhOptions& options_;
    Triangles corners_;
};

// The primitives of some shapes that can be hit, with their boxes.
struct Primitives {
    std::vector<PrimitiveRecord> records;
    std::vector<BuildPrim> boxes;  // by index of the record
    double condition = 1;          // the worst
};

// False where nothing of the box can be hit.
bool set_box(const Box3d& box, uint32_t id, BuildPrim& prim) {
    Box3 rounded;
    if (!round_outward(box, rounded)) return false;
    prim.id = id;
    for (int k = 0; k < 3; ++k) {
        prim.lower[k] = rounded.min[k];
        prim.upper[k] = rounded.max[k];
    }
    return true;
}

Primitives collect_primitives(std::span<const TriangleSoupView> shapes,
                              const TriangleNumbers& numbers) {
    Primitives all;
    for (size_t s = 0; s < shapes.size(); ++s) {
        const geometry::PrimitiveSet* set = shapes[s].primitives.get();
        for (uint32_t i = 0; set && i < set->size(); ++i) {
            const geometry::PrimitiveBounds bounds = set->bounds(i);
            BuildPrim prim{};
            if (!set_box(bounds.box, uint32_t(all.records.size()), prim)) continue;
            all.boxes.push_back(prim);
            all.records.push_back({set, i, numbers.first(s) + i});
            all.condition = std::max(all.condition, bounds.condition);
        }
    }
    return all;
}

// What rounding may move a far ray by, in multiples of its distance.
double origin_slack(double condition) {
    return 0x1p-46 * condition;
}

PrimitiveTree build_primitive_tree(std::span<const TriangleSoupView> shapes,
                                   const TriangleNumbers& numbers,
                                   const BvhOptions& options) {
    Primitives all = collect_primitives(shapes, numbers);
    PrimitiveTree result;
    result.primitives = std::move(all.records);
    result.origin_slack = origin_slack(all.condition);
    BuildPrims boxes(all.boxes.size());
    for (const BuildPrim& box : all.boxes) boxes.push_back(box);
    result.tree = collapse_to_ids(build_binary_tree(std::move(boxes), binary_options_of(options)));
    return result;
}

bool has_primitives(const std::vector<TriangleSoupView>& shapes) {
    return std::any_of(shapes.begin(), shapes.end(),
                       [](const TriangleSoupView& s) { return s.primitives != nullptr; });
}

bool has_motion(const std::vector<TriangleSoupView>& shapes) {
    return std::any_of(shapes.begin(), shapes.end(),
                       [](const TriangleSoupView& s) { return s.segments() > 0; });
}

// How finely prototypes are outlined to place them: more boxes fit closer, and are mapped for
// every instance.
constexpr size_t max_outline_boxes = 64, max_placed_boxes = size_t(1) << 24;

class Bvh final : public Accelerator {
  public:
    Bvh(const SoupScene& scene, BvhOptions options)
        : kernels_(options.kernels ? *options.kernels : best_kernels()),
          options_(options),
          has_classes_(!scene.classes.is_empty()) {
        const auto start = std::chrono::steady_clock::now();
        if (has_classes_) options.keep_shapes_apart = true;
        const size_t prototypes = scene.prototypes.size();
        std::vector<AcceleratorStats> stored(prototypes + 1);
        keep_sets(scene);
        trees_.prototypes.resize(prototypes);
        if (std::any_of(scene.prototypes.begin(), scene.prototypes.end(), &has_primitives))
            trees_.prototype_primitives.resize(prototypes);
        if (std::any_of(scene.prototypes.begin(), scene.prototypes.end(), &has_motion))
            trees_.prototype_motion.resize(prototypes);
        prototype_numbers_.resize(prototypes);
        parallel_for(prototypes + 1, [&](size_t i) {
            const bool is_direct = i == prototypes;
            const std::vector<TriangleSoupView>& shapes =
                is_direct ? scene.shapes : scene.prototypes[i];
            TriangleNumbers& numbers = is_direct ? direct_numbers_ : prototype_numbers_[i];
            numbers = TriangleNumbers(shapes);
            WideTree& tree = is_direct ? trees_.direct : trees_.prototypes[i];
            tree = TriangleTreeBuilder(shapes, numbers, options).run(stored[i]);
            if (has_motion(shapes)) {
                MovingTrees& motion = is_direct ? trees_.direct_motion : trees_.prototype_motion[i];
                motion = build_moving_trees(shapes, numbers, options, stored[i]);
            }
            if (!is_direct && has_primitives(shapes))
                trees_.prototype_primitives[i] = build_primitive_tree(shapes, numbers, options);
        });
        build_top(scene, options);
        set_classes(scene, trees_);
        choose_kernels();
        for (const AcceleratorStats& part : stored) {
            stats_.triangles += part.triangles;
            stats_.references += part.references;
        }
        stats_.duplicates = sum_duplicates(stored);
        count_memory();
        stats_.quality = name_of(options.quality);
        stats_.build_seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        TreeHit best;
        if (!kernels_.intersect(trees_, ray, best)) return {};
        return hit_of(best);
    }

    bool is_occluded(const geometry::Ray& ray) const override {
        return kernels_.is_occluded(trees_, ray);
    }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        if (!has_classes_) return met.holds(0) ? intersect(ray) : geometry::Hit{};
        TreeHit best;
        if (!kernels_.intersect_some(trees_, ray, met, best)) return {};
        return hit_of(best);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        if (!has_classes_) return met.holds(0) && is_occluded(ray);
        return kernels_.is_occluded_by_some(trees_, ray, met);
    }

    void intersect_batch(std::span<const geometry::Ray> rays,
                         std::span<geometry::Hit> hits) const override {
        if (!has_batches()) return Accelerator::intersect_batch(rays, hits);
        std::vector<TreeHit> found(rays.size());
        kernels_.intersect_batch(trees_, rays, found);
        for (size_t i = 0; i < rays.size(); ++i)
            hits[i] = found[i].id == scene::none ? geometry::Hit{} : hit_of(found[i]);
    }

    void is_occluded_batch(std::span<const geometry::Ray> rays,
                           std::span<uint8_t> occluded) const override {
        if (!has_batches()) return Accelerator::is_occluded_batch(rays, occluded);
        kernels_.occlude_batch(trees_, rays, occluded);
    }

    bool has_batches() const override {
        return kernels_.intersect_batch != nullptr && trees_.top.is_empty() &&
               trees_.moving_instances.empty();
    }

    bool move_instances(const SoupScene& scene) override {
        trees_.instances.clear();
        prototype_of_instance_.clear();
        moving_bounds_ = Box3();
        build_top(scene, options_);
        set_classes(scene, trees_);
        choose_kernels();
        stats_.nodes = stats_.bytes = stats_.primitives = 0;
        count_memory();
        return true;
    }

    Box3 bounds() const override {
        Box3 box = trees_.direct.bounds;
        box.extendBy(trees_.direct_motion.bounds);
        box.extendBy(moving_bounds_);
        box.extendBy(trees_.top.bounds);
        return box;
    }

    AcceleratorStats stats() const override { return stats_; }

  private:
    void choose_kernels() {
        const Kernels all = options_.kernels ? *options_.kernels : best_kernels();
        const bool moves = trees_.has_motion();
        kernels_.intersect = moves ? all.intersect_moving : all.intersect;
        kernels_.is_occluded = moves ? all.is_occluded_moving : all.is_occluded;
    }

    geometry::Hit hit_of(const TreeHit& best) const {
        geometry::Hit hit;
        hit.t = best.t;
        hit.b1 = best.b1;
        hit.b2 = best.b2;
        hit.instance = best.instance;
        const TriangleNumbers& numbers = numbers_of(best.instance);
        hit.shape = numbers.shape(best.id);
        if (numbers.is_flipped(hit.shape)) std::swap(hit.b1, hit.b2);
        hit.triangle = best.id - numbers.first(hit.shape);
        return hit;
    }

    // [prototype], then what is placed directly.
    static Duplicates sum_duplicates(std::span<const AcceleratorStats> stored) {
        Duplicates sum;
        for (size_t i = stored.size(); i-- > 0;) {
            Duplicates part = stored[i].duplicates;
            if (part.count == 0) continue;
            if (i + 1 < stored.size()) part.prototype = uint32_t(i);
            part.count += sum.count;
            sum = part;
        }
        return sum;
    }

    const TriangleNumbers& numbers_of(uint32_t instance) const {
        return instance == scene::none ? direct_numbers_
                                       : prototype_numbers_[prototype_of_instance_[instance]];
    }

    // Trees point to the primitives of the scene.
    void keep_sets(const SoupScene& scene) {
        const auto keep = [&](const std::vector<TriangleSoupView>& shapes) {
            for (const TriangleSoupView& shape : shapes)
                if (shape.primitives) sets_.push_back(shape.primitives);
        };
        keep(scene.shapes);
        for (const auto& shapes : scene.prototypes) keep(shapes);
    }

    std::vector<Outline> outlines(size_t instances) const {
        const size_t max = std::clamp(max_placed_boxes / std::max(instances, size_t(1)), size_t(1),
                                      max_outline_boxes);
        std::vector<Outline> all(trees_.prototypes.size());
        for (size_t i = 0; i < all.size(); ++i) {
            all[i].boxes = outline(trees_.prototypes[i], max);
            if (!trees_.prototype_motion.empty() && !trees_.prototype_motion[i].is_empty())
                all[i].boxes.push_back(box_of_motion(trees_.prototype_motion[i]));
            if (trees_.prototype_primitives.empty()) continue;
            const PrimitiveTree& primitives = trees_.prototype_primitives[i];
            const std::vector<Box3> more = outline(primitives.tree, max);
            all[i].boxes.insert(all[i].boxes.end(), more.begin(), more.end());
            all[i].condition = std::max(1.0, primitives.origin_slack / origin_slack(1));
        }
        return all;
    }

    void build_top(const SoupScene& scene, const BvhOptions& options) {
        Primitives direct = collect_primitives(scene.shapes, direct_numbers_);
        BuildPrims prims(scene.instances.size() + direct.boxes.size());
        double worst_condition = 1;
        const std::vector<Outline> outline_of = outlines(scene.instances.size());
        prototype_of_instance_.reserve(scene.instances.size());
        for (size_t i = 0; i < scene.instances.size(); ++i) {
            const SoupInstance& instance = scene.instances[i];
            VELATURA_CHECK(instance.prototype < trees_.prototypes.size(),
                           "instance of no prototype");
            prototype_of_instance_.push_back(instance.prototype);
            if (!instance.later.empty()) continue;
            const Outline& outline = outline_of[instance.prototype];
            PlacedBox placed;
            placed.record.tree = instance.prototype;
            placed.record.instance = uint32_t(i);
            if (outline.boxes.empty() ||
                !place(instance.render_from_prototype, outline.boxes, placed))
                continue;
            BuildPrim prim{};
            const Box3d placed_box(placed.lower, placed.upper);
            if (!set_box(placed_box, uint32_t(trees_.instances.size()), prim)) continue;
            worst_condition = std::max(worst_condition, placed.condition * outline.condition);
            prims.push_back(prim);
            trees_.instances.push_back(placed.record);
        }
        for (BuildPrim& prim : direct.boxes) {
            prim.id += uint32_t(trees_.instances.size());
            prims.push_back(prim);
        }
        trees_.primitives = std::move(direct.records);
        trees_.top_origin_slack = origin_slack(std::max(worst_condition, direct.condition));
        trees_.top =
            collapse_to_ids(build_binary_tree(std::move(prims), binary_options_of(options)));
        trees_.moving_instances =
            place_moving_instances(scene.instances, outline_of, options, moving_bounds_);
    }

    void count_memory() {
        const auto add = [&](const WideTree& tree) {
            stats_.nodes += tree.nodes.size();
            stats_.bytes += tree.bytes();
        };
        const auto add_motion = [&](const MovingTrees& motion) {
            for (const MovingTree& tree : motion.trees) {
                stats_.nodes += tree.nodes.size();
                stats_.bytes += tree.bytes();
            }
        };
        add(trees_.direct);
        add_motion(trees_.direct_motion);
        for (const MovingTrees& motion : trees_.prototype_motion) add_motion(motion);
        add(trees_.top);
        for (const WideTree& tree : trees_.prototypes) add(tree);
        const auto add_primitives = [&](const std::vector<PrimitiveRecord>& records) {
            stats_.primitives += records.size();
            stats_.bytes += records.size() * sizeof(PrimitiveRecord);
        };
        add_primitives(trees_.primitives);
        for (const PrimitiveTree& set : trees_.prototype_primitives) {
            add(set.tree);
            add_primitives(set.primitives);
        }
        for (const TriangleNumbers& numbers : prototype_numbers_) stats_.bytes += numbers.bytes();
        stats_.bytes += direct_numbers_.bytes() + trees_.instances.size() * sizeof(InstanceRecord) +
                        prototype_of_instance_.size() * sizeof(uint32_t) + sizeof(Bvh) +
                        bytes(trees_.classes);
        stats_.instances = trees_.instances.size();
        for (const MovingInstances& moving : trees_.moving_instances) {
            stats_.instances += moving.instances.size();
            stats_.nodes += moving.boxes.nodes.size();
            stats_.bytes += moving.boxes.bytes() + moving.keys.size() * sizeof(Mat4) +
                            moving.instances.size() * sizeof(MovingInstance);
        }
    }

    Kernels kernels_;
    BvhOptions options_;
    bool has_classes_ = false;
    SceneTrees trees_;
    TriangleNumbers direct_numbers_;
    std::vector<TriangleNumbers> prototype_numbers_;
    std::vector<uint32_t> prototype_of_instance_;
    Box3 moving_bounds_;  // of instances that move
    std::vector<std::shared_ptr<const geometry::PrimitiveSet>> sets_;
    AcceleratorStats stats_;
};

std::vector<TriangleSoupView> views(const std::vector<geometry::TriangleMesh>& meshes) {
    std::vector<TriangleSoupView> result;
    for (const geometry::TriangleMesh& mesh : meshes) {
        result.push_back({mesh.positions(), mesh.triangles(), mesh.shared_primitives(),
                          mesh.later_positions(), mesh.flip_normals()});
    }
    return result;
}

SoupClasses classes_of(const scene::Scene& scene) {
    SoupClasses classes;
    for (const scene::Shape& shape : scene.shapes) classes.of_shape.push_back(shape.link);
    classes.rows = scene.linking.rows;
    for (const scene::Instance& instance : scene.instances)
        classes.row_of_instance.push_back(instance.link_row);
    return classes;
}

}  // namespace

BinaryBuildOptions binary_options_of(const BvhOptions& options) {
    BinaryBuildOptions binary;
    binary.bins = options.bins;
    binary.max_depth = std::clamp(options.max_depth, 0, 56);
    binary.backoff = std::clamp(options.backoff, 0, 16);
    return binary;
}

const char* name_of(BvhQuality quality) {
    switch (quality) {
        case BvhQuality::Fast:
            return "fast";
        case BvhQuality::Balanced:
            return "balanced";
        case BvhQuality::High:
            return "high";
    }
    return "";
}

BvhQuality choose_quality(double rays, size_t triangles) {
    // Per triangle, balanced costs up to a ray's time more than fast and may halve that of rays;
    // high costs one or two rays more than balanced and saves a few hundredths
    const double rays_per_triangle = rays / std::max(1.0, double(triangles));
    if (rays_per_triangle < 1) return BvhQuality::Fast;
    return rays_per_triangle < 100 ? BvhQuality::Balanced : BvhQuality::High;
}

BvhOptions options_of(BvhQuality quality) {
    switch (quality) {
        case BvhQuality::Fast:
            return {.bins = 8, .spare_references = 0, .quality = quality};
        case BvhQuality::Balanced:
            break;
        case BvhQuality::High:
            return {.leaf_size = 2, .backoff = 0, .quality = quality};
    }
    return {};
}

size_t triangle_count(const SoupScene& scene) {
    size_t count = 0;
    const auto add = [&](const std::vector<TriangleSoupView>& shapes) {
        for (const TriangleSoupView& shape : shapes) count += shape.triangles.size();
    };
    add(scene.shapes);
    for (const auto& prototype : scene.prototypes) add(prototype);
    return count;
}

std::unique_ptr<Accelerator> build_bvh(const SoupScene& scene, const BvhOptions& options) {
    return std::make_unique<Bvh>(scene, options);
}

SoupScene make_soup(const scene::Scene& scene, const geometry::GeometrySet& geometry) {
    SoupScene soup;
    soup.shapes = views(geometry.shapes());
    for (const auto& prototype : geometry.prototypes()) soup.prototypes.push_back(views(prototype));
    for (const scene::Instance& instance : scene.instances) {
        soup.instances.push_back({instance.prototype, instance.render_from_prototype,
                                  instance.later_render_from_prototype});
    }
    if (scene::asks_for_classes(scene)) soup.classes = classes_of(scene);
    return soup;
}

std::unique_ptr<Accelerator> build_bvh(const scene::Scene& scene,
                                       const geometry::GeometrySet& geometry,
                                       const BvhOptions& options) {
    return build_bvh(make_soup(scene, geometry), options);
}

}  // namespace velatura::accel
