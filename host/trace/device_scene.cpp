#include "trace/device_scene.h"

namespace castor {

DeviceScene upload_scene(DeviceContext& context, const PreparedScene& prepared) {
    const SceneArrays& arrays = prepared.arrays;
    const CompressedBvh& compressed = prepared.compressed;
    const WideBvh& wide = prepared.wide;
    DeviceScene scene;
    scene.vertex_position = context.upload(arrays.vertex_position, "vertex_position");
    scene.triangle_vertices = context.upload(arrays.triangle_vertices, "triangle_vertices");
    scene.vertex_normal = context.upload(arrays.vertex_normal, "vertex_normal");
    scene.mesh_ranges = context.upload(arrays.mesh_ranges, "mesh_ranges");
    scene.sphere_center_radius = context.upload(arrays.sphere_center_radius, "sphere_center_radius");
    scene.sphere_material = context.upload(arrays.sphere_material, "sphere_material");
    scene.plane_point = context.upload(arrays.plane_point, "plane_point");
    scene.plane_normal = context.upload(arrays.plane_normal, "plane_normal");
    scene.plane_material = context.upload(arrays.plane_material, "plane_material");
    scene.geometries = context.upload(arrays.geometries, "geometries");
    scene.instances = context.upload(arrays.instances, "instances");
    scene.instance_nodes = context.upload(prepared.instance_nodes, "instance_nodes");
    scene.compressed_roots = context.upload(compressed.roots, "compressed_roots");
    scene.wide_roots = context.upload(wide.roots, "wide_roots");
    scene.materials = context.upload(arrays.materials, "materials");
    scene.lights = context.upload(arrays.lights, "lights");
    scene.compressed_nodes = context.upload(compressed.nodes, "compressed_nodes");
    scene.compressed_primitives = context.upload(compressed.primitives, "compressed_primitives");
    for (const WideChunk& chunk : wide.chunks)
        scene.chunks.push_back({context.upload(wide.nodes, chunk.first_node, chunk.node_count, "wide_nodes"),
                                context.upload(wide.triangle_blocks, chunk.first_triangle_block, chunk.triangle_block_count, "triangle_blocks"),
                                context.upload(wide.sphere_blocks, chunk.first_sphere_block, chunk.sphere_block_count, "sphere_blocks")});
    if (wide.chunks.empty())
        scene.chunks.push_back({context.make_buffer(0, "wide_nodes"), context.make_buffer(0, "triangle_blocks"), context.make_buffer(0, "sphere_blocks")});

    scene.trace_params = {};
    scene.trace_params.triangle_count = static_cast<std::uint32_t>(arrays.triangle_count());
    scene.trace_params.sphere_count = static_cast<std::uint32_t>(arrays.sphere_count());
    scene.trace_params.plane_count = static_cast<std::uint32_t>(arrays.plane_count());
    scene.trace_params.mesh_count = static_cast<std::uint32_t>(arrays.mesh_ranges.size());
    scene.trace_params.node_count = static_cast<std::uint32_t>(compressed.nodes.size());
    scene.compressed_levels = compressed.levels;
    scene.trace_params.wide_root = wide.root;
    scene.trace_params.largest_coordinate = arrays.largest_coordinate();
    scene.trace_params.instance_count = static_cast<std::uint32_t>(arrays.instances.size());
    scene.trace_params.instance_node_count = static_cast<std::uint32_t>(prepared.instance_nodes.size());
    return scene;
}

}  // namespace castor
