# A client of simgl/1 for Julia 1.5: Pkg.add(["ZMQ", "MsgPack"]); julia client.jl ADDRESS
using MsgPack, ZMQ

const PATIENCE_S = 10.0

function receive(socket)
    frames = [recv(socket, Vector{UInt8})]
    while socket.rcvmore
        push!(frames, recv(socket, Vector{UInt8}))
    end
    return frames
end

function ask(socket, kind, header)
    send(socket, "simgl/1"; more=true)
    send(socket, pack(header))
    while true
        arriving = @async receive(socket)
        timedwait(() -> istaskdone(arriving), PATIENCE_S) === :ok || error("no answer in time")
        frames = fetch(arriving)
        reply = unpack(frames[2])
        reply["type"] == "error" && error("$(reply["code"]): $(reply["detail"])")
        reply["type"] == "bye" && error("the server said goodbye")
        reply["type"] == kind && return reply, frames[3:end] # not the pong of a server that starts
    end
end

function render(socket, id, tai_ns, camera, bodies)
    header = (type="render", id=id, tai_ns=tai_ns, cameras=[(camera=camera,)], bodies=bodies)
    reply, planes = ask(socket, "images", header)
    height, width = reply["images"][1]["planes"][1]["shape"]
    dn = permutedims(reshape(ltoh.(reinterpret(UInt16, planes[1])), Int(width), Int(height)))
    return reply, dn
end

socket = Socket(DEALER)
socket.linger = 0
connect(socket, isempty(ARGS) ? "tcp://127.0.0.1:5563" : ARGS[1])
welcome, _ = ask(socket, "welcome", (type="hello", client="julia", versions=["simgl/1"]))
chaser = (position_m=[0.5, -0.25, 40.0], velocity_m_s=[0.0, 0.0, -0.1],
    q_icrf_from_body_xyzw=[0.0, 0.0, 0.0, 1.0])
camera = welcome["cameras"][1]["name"]
reply, dn = render(socket, 1, welcome["epoch_tai_ns"], camera, (chaser=chaser,))
println("$(size(dn, 2)) x $(size(dn, 1)), sum $(sum(Int, dn)), $(reply["state_hash"])")
close(socket)
