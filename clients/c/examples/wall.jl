# SPDX-License-Identifier: Apache-2.0
# A wall of 2000 N/m at x = 0. NOT RUN: Debian 12 has no Julia.
mutable struct Config; size::UInt32; flags::UInt32; server::Cstring; rest::NTuple{4, Ptr{Cvoid}}; numbers::NTuple{4, UInt64}; end
mutable struct State
    size::UInt32; has::UInt32; tick::UInt64; sampled_ns::Int64; position::NTuple{3, Float64}; velocity::NTuple{3, Float64}
    force_applied::NTuple{3, Float64}; rest::NTuple{17, Float64}
end
mutable struct Force; size::UInt32; has::UInt32; tick::UInt64; force::NTuple{3, Float64}; rest::NTuple{28, Float64}; end
server = "127.0.0.1:47100"
config = Config(sizeof(Config), 0, Base.unsafe_convert(Cstring, server), ntuple(i -> C_NULL, 4), ntuple(i -> UInt64(0), 4))
client = GC.@preserve server @ccall "libtendon.so.1".tendon_open(Ref(config)::Ptr{Config}, C_NULL::Ptr{Cchar}, 0::Csize_t)::Ptr{Cvoid}
hand = State(sizeof(State), 0, 0, 0, (0, 0, 0), (0, 0, 0), (0, 0, 0), ntuple(i -> 0.0, 17))
while (@ccall "libtendon.so.1".tendon_wait(client::Ptr{Cvoid}, Ref(hand)::Ptr{State}, (10^9)::Int64)::Cint) == 0
    wall = Force(sizeof(Force), 0, hand.tick, (min(0, -2000 * hand.position[1]), 0, 0), ntuple(i -> 0.0, 28))
    @ccall "libtendon.so.1".tendon_send(client::Ptr{Cvoid}, Ref(wall)::Ptr{Force})::Cint
end
