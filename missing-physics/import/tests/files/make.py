import numpy as np, math
rng=np.random.default_rng(3)
def drop(v0, n, dt=1/60, h=2.0, m=0.0577, d=0.0655, cd=0.5):
    # quadratic drag by small steps
    k=1.2*cd*math.pi*d*d/4/(2*m); z,v=h,v0; out=[]; sub=200
    for i in range(n):
        out.append(z)
        for _ in range(sub):
            a=-9.80665-k*abs(v)*v; v+=a*dt/sub; z+=v*dt/sub
    return np.array(out)
n=34; t=np.arange(n)/60
runs=[drop(v,n)+rng.normal(0,.002,n) for v in (0.0,0.8,1.5)]
def g(x,digits): return f"{x:.{digits}f}".replace('.',',')
with open('../../../../recordings/throws.csv','wb') as f:
    s='\ufeff# Tracker 6.1, Kamera 60 Hz\r\nVersuch;Zeit [ms];Höhe (mm);Temperatur (°C)\r\n'
    for r,z in enumerate(runs,1):
        for ti,zi in zip(t,z): s+=f"{r};{g(1000*ti,2)};{g(1000*zi,1)};{g(21.3,1)}\r\n"
    f.write(s.encode('utf-8'))
with open('labview.txt','wb') as f:
    s='LabVIEW Measurement\r\nOperator\tM. Müller\r\n\r\nZeit\tHöhe\r\ns\tcm\r\n'
    for k,z in enumerate(runs):
        for ti,zi in zip(t,z): s+=f"{g(ti+5*k+2.0,4)}\t{g(100*zi,2)}\t\r\n"
    f.write(s.encode('cp1252'))
np.savetxt('savetxt.dat', np.column_stack([t,runs[0]]), header='t z', fmt='%.6g')
with open('excel.tsv','wb') as f:
    s='time\tz\n'+''.join(f"2026-11-23 10:15:{30+ti:06.3f}\t{zi:.4f}\n" for ti,zi in zip(t,runs[1]))
    f.write(s.encode('utf-16'))
np.savez_compressed('flight.npz', t=t, z=runs[1].astype('f4'), mass=0.0577)
np.save('flight.npy', np.column_stack([t,runs[2]]))
np.save('struct.npy', np.array(list(zip(t,runs[2])), dtype=[('t','<f8'),('z','<f4')]))
from scipy.io import savemat
savemat('flight.mat', {'t_ms':(1000*t)[None,:], 'z':runs[0], 'note':'tennis ball', 'rig':{'mass':0.0577}}, do_compression=True)
import pyarrow as pa, pyarrow.parquet as pq
ep=np.repeat([0,1,2],n); state=[[float(np.float32(z)),float(np.float32(0.1*z))] for r in runs for z in r]
tab=pa.table({'observation.state':pa.array(state,type=pa.list_(pa.float32(),2)),
  'action':pa.array([[float(np.float32(0.5*s[0]))] for s in state],type=pa.list_(pa.float32(),1)),
  'timestamp':pa.array(np.tile(t,3).astype('f4')),'frame_index':pa.array(np.tile(np.arange(n),3)),
  'episode_index':pa.array(ep),'index':pa.array(np.arange(3*n)),'task_index':pa.array(np.zeros(3*n,dtype=int)),'next.done':pa.array([i%n==n-1 for i in range(3*n)])})
import os, json
os.makedirs('lerobot/data/chunk-000',exist_ok=True); os.makedirs('lerobot/meta',exist_ok=True)
pq.write_table(tab,'lerobot/data/chunk-000/file-000.parquet')
json.dump({'codebase_version':'v3.0','fps':60,'features':{'observation.state':{'dtype':'float32','shape':[2],'names':['height.pos','gripper.pos']},'action':{'dtype':'float32','shape':[1],'names':{'motors':['height.pos']}}}},open('lerobot/meta/info.json','w'))
import pandas as pd
pd.DataFrame({'time':pd.to_datetime('2026-11-23')+pd.to_timedelta(t,unit='s'),'z':runs[0],'label':['a']*n}).to_parquet('pandas.parquet',compression='zstd')
import wave
with wave.open('drop.wav','wb') as w:
    w.setnchannels(1); w.setsampwidth(2); w.setframerate(4000)
    x=np.zeros(5500); at=0.1; gap=0.35
    for _ in range(5):
        i=int(at*4000); k=np.arange(200); x[i:i+200]+=9000*np.exp(-k/30)*np.sin(k); at+=gap; gap*=0.75
    w.writeframes(x.astype('<i2').tobytes())
from mcap_ros2.writer import Writer
defs={'geometry_msgs/msg/PoseStamped':"""std_msgs/Header header
geometry_msgs/Pose pose
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
""",
'geometry_msgs/msg/WrenchStamped':"""std_msgs/Header header
geometry_msgs/Wrench wrench
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Wrench
# force and torque
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
""",
'sensor_msgs/msg/JointState':"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
""",
'sensor_msgs/msg/Image':"""std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""}
def stamp(ns): return {'sec':int(ns//10**9),'nanosec':int(ns%10**9)}
f=open('bag.mcap','wb'); w=Writer(f)
sch={k:w.register_msgdef(k,v) for k,v in defs.items()}
T0=1_795_000_000_000_000_000
for i in range(n):
    ns=T0+int(t[i]*1e9); h={'stamp':stamp(ns),'frame_id':'world'}
    w.write_message('/ball/pose',sch['geometry_msgs/msg/PoseStamped'],{'header':h,'pose':{'position':{'x':0.1,'y':0.0,'z':float(runs[0][i])},'orientation':{'x':0.,'y':0.,'z':0.,'w':1.}}},log_time=ns+300_000,publish_time=ns)
    names=['shoulder','elbow'] if i%2==0 else ['elbow','shoulder']
    val={'shoulder':0.5+0.01*i,'elbow':-0.2-0.01*i}
    w.write_message('/joint_states',sch['sensor_msgs/msg/JointState'],{'header':h,'name':names,'position':[val[k] for k in names],'velocity':[0.1,0.2],'effort':[]},log_time=ns+400_000,publish_time=ns)
    for s in range(3):
        m=ns+int(s*5e6); w.write_message('/wrench',sch['geometry_msgs/msg/WrenchStamped'],{'header':{'stamp':stamp(m),'frame_id':'tool'},'wrench':{'force':{'x':0.1*s,'y':-7.3,'z':float(i+s/3)},'torque':{'x':0.,'y':0.,'z':0.01}}},log_time=m,publish_time=m)
    if i%10==0: w.write_message('/camera',sch['sensor_msgs/msg/Image'],{'header':h,'height':8,'width':8,'encoding':'mono8','is_bigendian':0,'step':8,'data':bytes(64)+b'x'*40},log_time=ns,publish_time=ns)
w.finish(); f.close()
