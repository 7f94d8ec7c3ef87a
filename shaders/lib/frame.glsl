// The shading frame: normal, tangent, bitangent, unit and perpendicular; n points to the lit side.
struct Frame {
    vec3 n;
    vec3 t;
    vec3 b;
};
