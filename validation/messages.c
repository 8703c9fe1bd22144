/* Counts what the ranks of a run send: point-to-point messages and their bytes, and collective calls with the bytes that a rank
 * gives. Loaded before the program (LD_PRELOAD); the calls of C and of Fortran (MUMPS) go through the same counters. At the
 * end the first rank writes the sums over all ranks into the file of the variable MESSAGES. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>

enum { SENT, SENT_BYTES, COLLECTIVE, COLLECTIVE_BYTES, COUNTERS };
static double counted[COUNTERS];

static void add(int kind, int count, MPI_Datatype type) {
    int size = 0;
    if (type != MPI_DATATYPE_NULL) PMPI_Type_size(type, &size);
    counted[kind] += 1;
    counted[kind + 1] += (double)count * size;
}

/* Persistent sends: the request and the bytes of a start. */
static struct { MPI_Request request; double bytes; } kept[1 << 14];
static int many;

static void started(MPI_Request request) {
    for (int i = many - 1; i >= 0; i--)
        if (kept[i].request == request) {
            counted[SENT] += 1;
            counted[SENT_BYTES] += kept[i].bytes;
            return;
        }
}

int MPI_Send_init(const void *b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c, MPI_Request *r) {
    int size, code = PMPI_Send_init(b, n, t, to, tag, c, r);
    PMPI_Type_size(t, &size);
    if (many < 1 << 14) kept[many].request = *r, kept[many++].bytes = (double)n * size;
    return code;
}
int MPI_Start(MPI_Request *r) { started(*r); return PMPI_Start(r); }
int MPI_Startall(int n, MPI_Request r[]) {
    for (int i = 0; i < n; i++) started(r[i]);
    return PMPI_Startall(n, r);
}

#define SEND(NAME) \
    int MPI_##NAME(const void *b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c) \
    { add(SENT, n, t); return PMPI_##NAME(b, n, t, to, tag, c); }
#define ISEND(NAME) \
    int MPI_##NAME(const void *b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c, MPI_Request *r) \
    { add(SENT, n, t); return PMPI_##NAME(b, n, t, to, tag, c, r); }
SEND(Send) SEND(Rsend) SEND(Ssend) ISEND(Isend) ISEND(Irsend) ISEND(Issend)

int MPI_Allreduce(const void *a, void *b, int n, MPI_Datatype t, MPI_Op o, MPI_Comm c)
{ add(COLLECTIVE, n, t); return PMPI_Allreduce(a, b, n, t, o, c); }
int MPI_Reduce(const void *a, void *b, int n, MPI_Datatype t, MPI_Op o, int root, MPI_Comm c)
{ add(COLLECTIVE, n, t); return PMPI_Reduce(a, b, n, t, o, root, c); }
int MPI_Bcast(void *b, int n, MPI_Datatype t, int root, MPI_Comm c)
{ add(COLLECTIVE, n, t); return PMPI_Bcast(b, n, t, root, c); }
int MPI_Allgather(const void *a, int n, MPI_Datatype t, void *b, int m, MPI_Datatype u, MPI_Comm c)
{ add(COLLECTIVE, n, t); return PMPI_Allgather(a, n, t, b, m, u, c); }
int MPI_Allgatherv(const void *a, int n, MPI_Datatype t, void *b, const int m[], const int d[], MPI_Datatype u, MPI_Comm c)
{ add(COLLECTIVE, n, t); return PMPI_Allgatherv(a, n, t, b, m, d, u, c); }
int MPI_Barrier(MPI_Comm c) { add(COLLECTIVE, 0, MPI_DATATYPE_NULL); return PMPI_Barrier(c); }

/* Fortran's names of the same functions. */
#define FSEND(NAME) \
    void p##NAME(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *); \
    void NAME(void *b, MPI_Fint *n, MPI_Fint *t, MPI_Fint *to, MPI_Fint *tag, MPI_Fint *c, MPI_Fint *e) \
    { add(SENT, *n, MPI_Type_f2c(*t)); p##NAME(b, n, t, to, tag, c, e); }
#define FISEND(NAME) \
    void p##NAME(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *); \
    void NAME(void *b, MPI_Fint *n, MPI_Fint *t, MPI_Fint *to, MPI_Fint *tag, MPI_Fint *c, MPI_Fint *r, MPI_Fint *e) \
    { add(SENT, *n, MPI_Type_f2c(*t)); p##NAME(b, n, t, to, tag, c, r, e); }
FSEND(mpi_send_) FISEND(mpi_isend_)
void pmpi_allreduce_(void *, void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_allreduce_(void *a, void *b, MPI_Fint *n, MPI_Fint *t, MPI_Fint *o, MPI_Fint *c, MPI_Fint *e)
{ add(COLLECTIVE, *n, MPI_Type_f2c(*t)); pmpi_allreduce_(a, b, n, t, o, c, e); }
void pmpi_bcast_(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_bcast_(void *b, MPI_Fint *n, MPI_Fint *t, MPI_Fint *root, MPI_Fint *c, MPI_Fint *e)
{ add(COLLECTIVE, *n, MPI_Type_f2c(*t)); pmpi_bcast_(b, n, t, root, c, e); }

int MPI_Finalize(void) {
    double all[COUNTERS];
    int rank;
    PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
    PMPI_Reduce(counted, all, COUNTERS, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
    const char *name = getenv("MESSAGES");
    FILE *file = rank == 0 && name ? fopen(name, "w") : NULL;
    if (file) {
        for (int i = 0; i < COUNTERS; i++) fprintf(file, "%.0f\n", all[i]);
        fclose(file);
    }
    return PMPI_Finalize();
}
