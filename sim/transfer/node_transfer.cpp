#include "sim/transfer/node_transfer.h"

#include "sim/transfer/grid_transfer_bodies.h"

namespace sim {

template class GridTransfer<NodeLayout<2, float>>;
template class GridTransfer<NodeLayout<3, float>>;
template class GridTransfer<NodeLayout<2, double>>;
template class GridTransfer<NodeLayout<3, double>>;

}  // namespace sim
