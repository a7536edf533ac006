#pragma once

namespace thermbal::test {

/// How often this process has asked for a user's or a group's entry so far: each may wait for a network.
int name_service_calls();

}  // namespace thermbal::test
