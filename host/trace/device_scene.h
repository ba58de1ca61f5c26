#pragma once

#include <cstdint>
#include <vector>

#include "opencl/device_context.h"
#include "trace/prepared_scene.h"

namespace castor {

/// The columns of a scene on one device, named as in SceneArrays, CompressedBvh and WideBvh. They may share the arrays' memory, which must outlive them.
struct DeviceScene {
    cl::Buffer vertex_position;       // float, 3 a vertex
    cl::Buffer triangle_vertices;     // uint, 3 a triangle
    cl::Buffer vertex_normal;         // float, 3 a normal
    cl::Buffer mesh_ranges;           // MeshRange
    cl::Buffer sphere_center_radius;  // float4
    cl::Buffer sphere_material;       // uint
    cl::Buffer plane_point;           // float4
    cl::Buffer plane_normal;          // float4
    cl::Buffer plane_material;        // uint
    cl::Buffer geometries;            // Geometry
    cl::Buffer instances;             // Instance
    cl::Buffer instance_nodes;        // InstanceNode
    cl::Buffer compressed_roots;      // uint, one a geometry
    cl::Buffer wide_roots;            // likewise
    cl::Buffer materials;             // Material
    cl::Buffer lights;                // Light
    cl::Buffer compressed_nodes;      // CompressedNode
    cl::Buffer compressed_primitives; // uint
    /// The wide tree, a WideChunk each; at least one, which may be empty.
    struct Chunk {
        cl::Buffer wide_nodes;       // WideNode
        cl::Buffer triangle_blocks;  // TriangleBlock
        cl::Buffer sphere_blocks;    // SphereBlock
    };
    std::vector<Chunk> chunks;
    shared::TraceParams trace_params;  // counts and largest_coordinate filled in
    std::uint32_t compressed_levels;   // of the compressed tree
};

/// Columns of trees that `prepared` has not are empty.
DeviceScene upload_scene(DeviceContext& context, const PreparedScene& prepared);

}  // namespace castor
