// Where a table of an environment stands in the column environment_parts (host/scene/environment_table.h).
#include "castor/shared/types.h"

typedef struct EnvironmentTable {
    uint across_bits, down_bits;  // of the cells' numbers
    uint texel_bits;              // of the numbers of a cell's texels, across and down
    const global uint *tree;      // of the parts: levels of four words a node
    const global uint *parts;     // the last level: where each cell's begin, and the end
} EnvironmentTable;

// `is_joined`: the directions are drawn in other ways, too, by which light that is not brighter than the average is
// found well enough.
CASTOR_INLINE EnvironmentTable environment_table(const global uint *restrict environment_parts, const uint first,
                                                 const int is_joined)
{
    const global uint *const header = environment_parts + first;
    EnvironmentTable table;
    table.across_bits = header[0];
    table.down_bits = header[1];
    table.texel_bits = header[2];
    const uint tree_words = header[3];
    table.tree = header + CASTOR_ENVIRONMENT_HEADER + (is_joined ? tree_words : 0u);
    table.parts = table.tree + tree_words - 4u - max(1u << (table.across_bits + table.down_bits), 4u);
    return table;
}
