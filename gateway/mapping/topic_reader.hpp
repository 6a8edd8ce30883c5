// Which topic an entry is about: what differs between the kinds of gateways.
#pragma once

#include "gateway/mapping/attributes.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

DdsTopic read_dds_topic(Attributes& attributes, bool is_in);
IceoryxTopic read_iceoryx_topic(Attributes& attributes, bool is_in);

}  // namespace arbiter::gateway
