# SPDX-License-Identifier: Apache-2.0
# A wall of 2000 N/m at x = 0. NOT RUN: Debian 12 has no Julia.
const Numbers{N} = NTuple{N, Float64}
mutable struct Config
    size::UInt32; flags::UInt32; server::Cstring; rest::NTuple{4, Ptr{Cvoid}}; numbers::NTuple{4, UInt64}
end
mutable struct State
    size::UInt32; has::UInt32; tick::UInt64; sampled_ns::Int64; position::Numbers{3}; rest::Numbers{23}
end
mutable struct Force; size::UInt32; has::UInt32; tick::UInt64; force::Numbers{3}; rest::Numbers{28}; end
const lib, server, zeros_of = "libtendon.so.1", "127.0.0.1:47100", n -> ntuple(i -> 0.0, n)
config = Config(sizeof(Config), 0, Base.unsafe_convert(Cstring, server), ntuple(i -> C_NULL, 4), ntuple(i -> 0, 4))
client = @ccall lib.tendon_open(Ref(config)::Ptr{Config}, C_NULL::Ptr{Cchar}, 0::Csize_t)::Ptr{Cvoid}
hand = State(sizeof(State), 0, 0, 0, zeros_of(3), zeros_of(23))
while (@ccall lib.tendon_wait(client::Ptr{Cvoid}, Ref(hand)::Ptr{State}, (10^9)::Int64)::Cint) == 0
    wall = Force(sizeof(Force), 0, hand.tick, (min(0, -2000 * hand.position[1]), 0, 0), zeros_of(28))
    @ccall lib.tendon_send(client::Ptr{Cvoid}, Ref(wall)::Ptr{Force})::Cint
end
