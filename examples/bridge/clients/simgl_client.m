% A client of simgl/1 for MATLAB, and for Octave with Java. Needs the classes of JeroMQ and msgpack-core:
% javaaddpath({'jeromq.jar', 'msgpack-core.jar'}); simgl_client('tcp://127.0.0.1:5563')
function dn = simgl_client(address)
  socket = javaMethod('socket', javaMethod('context', 'org.zeromq.ZMQ', 1), 5); % a DEALER
  javaMethod('setReceiveTimeOut', socket, 10000);
  javaMethod('setLinger', socket, 0);
  javaMethod('connect', socket, address);
  welcome = header(ask(socket, 'welcome', struct('type', 'hello', 'client', 'matlab', ...
    'versions', {{'simgl/1'}})));
  camera = char(javaMethod('toString', at(item(at(welcome, 'cameras'), 0), 'name')));
  chaser = struct('position_m', [0.5, -0.25, 40], 'velocity_m_s', [0, 0, -0.1], ...
    'q_icrf_from_body_xyzw', [0, 0, 0, 1]);
  % The epoch stays a Java value: nanoseconds since 1970 do not fit into a double.
  images = ask(socket, 'images', struct('type', 'render', 'id', int32(1), ...
    'tai_ns', at(welcome, 'epoch_tai_ns'), 'cameras', {{struct('camera', camera)}}, ...
    'bodies', struct('chaser', chaser)));
  shape = at(item(at(item(at(header(images), 'images'), 0), 'planes'), 0), 'shape');
  height = str2double(char(javaMethod('toString', item(shape, 0))));
  width = str2double(char(javaMethod('toString', item(shape, 1))));
  pixels = typecast(javaMethod('getData', javaMethod('getLast', images)), 'uint16');
  dn = reshape(pixels, width, height)'; % row by row, as numbers of this machine: little-endian
  fprintf('%d x %d, sum %d, %s\n', width, height, sum(double(dn(:))), ...
    char(javaMethod('toString', at(header(images), 'state_hash'))));
  javaMethod('close', socket);
end

function reply = ask(socket, kind, request) % frames behind the version of the reply of a kind
  packer = javaMethod('newDefaultBufferPacker', 'org.msgpack.core.MessagePack');
  pack(packer, request);
  javaMethod('sendMore', socket, 'simgl/1');
  javaMethod('send', socket, javaMethod('toByteArray', packer), 0);
  while true % not the pong of a server that starts
    reply = javaMethod('recvMsg', 'org.zeromq.ZMsg', socket);
    if isempty(reply), error('no answer in time'); end
    javaMethod('pop', reply);
    type = char(javaMethod('toString', at(header(reply), 'type')));
    if strcmp(type, kind), return; end
    if any(strcmp(type, {'error', 'bye'})), error(char(javaMethod('toString', header(reply)))); end
  end
end

function pack(to, value)
  if isstruct(value)
    names = fieldnames(value);
    javaMethod('packMapHeader', to, numel(names));
    for i = 1:numel(names)
      pack(to, names{i});
      pack(to, value.(names{i}));
    end
  elseif ischar(value), javaMethod('packString', to, value);
  elseif isjava(value), javaMethod('packValue', to, value);
  elseif isinteger(value), javaMethod('packInt', to, value);
  elseif isscalar(value) && ~iscell(value), javaMethod('packDouble', to, value);
  else
    if ~iscell(value), value = num2cell(value); end
    javaMethod('packArrayHeader', to, numel(value));
    for i = 1:numel(value), pack(to, value{i}); end
  end
end

function value = header(reply)
  bytes = javaMethod('getData', javaMethod('peekFirst', reply));
  value = javaMethod('unpackValue', javaMethod('newDefaultUnpacker', 'org.msgpack.core.MessagePack', bytes));
end

function value = at(map, key)
  named = javaMethod('newString', 'org.msgpack.value.ValueFactory', key);
  value = javaMethod('get', javaMethod('map', javaMethod('asMapValue', map)), named);
end

function value = item(list, index)
  value = javaMethod('get', javaMethod('asArrayValue', list), index);
end
