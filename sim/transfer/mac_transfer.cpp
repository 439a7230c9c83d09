#include "sim/transfer/mac_transfer.h"

#include "sim/transfer/grid_transfer_bodies.h"

namespace sim {

template class GridTransfer<FaceLayout<2, float>>;
template class GridTransfer<FaceLayout<3, float>>;
template class GridTransfer<FaceLayout<2, double>>;
template class GridTransfer<FaceLayout<3, double>>;

}  // namespace sim
